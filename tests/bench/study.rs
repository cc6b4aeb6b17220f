//! `cargo bench -- study`: response times for concurrent answers of many participants, sent by the load generator
//! autocannon, of the study server and of a minimal route that only writes the same row (`synchronous=FULL`).

use super::report::{Report, median};
use super::served_study::{Client, MadeStudy, answer, fitting};
use anyhow::{Context, Result, ensure};
use axum::Router;
use axum::body::Bytes;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::routing::post;
use orator_base::stage::progress::Progress;
use orator_study::store::{answers, database};
use rusqlite::Connection;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};

/// Length of the films, short enough that no answer is rejected as too early.
const FRAMES: usize = 5;

/// Response time of the study server in milliseconds while all participants answer concurrently, compared with a
/// minimal route that writes the same row. Needs node and autocannon (`make loader`).
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Number of concurrent participants, each with a connection.
    #[arg(long, default_value_t = 200, value_name = "N")]
    participants: usize,
    /// Number of consecutive answers of each participant.
    #[arg(long, default_value_t = 20, value_name = "N")]
    answers: usize,
    /// Rounds; each measures both once.
    #[arg(long, default_value_t = 5, value_name = "N")]
    rounds: usize,
    /// Folder whose node_modules contain autocannon; default: ORATOR_LOADER, or target/loader.
    #[arg(long, value_name = "FOLDER")]
    loader: Option<PathBuf>,
}

/// Median and 99 % quantile of the response times, milliseconds.
type Quantiles = [f64; 2];

pub(crate) fn run(args: &Args, progress: &dyn Progress) -> Result<Report> {
    ensure!(args.rounds > 0 && args.participants > 0 && args.answers > 1, "nothing to measure");
    let task = progress.begin("study", args.rounds as u64);
    let (mut bare, mut served) = (Vec::new(), Vec::new());
    for _ in 0..args.rounds {
        bare.push(bare_route(args)?);
        served.push(study_server(args)?);
        task.advance(1);
    }
    let medians = |rounds: &[Quantiles]| [0, 1].map(|k| median(rounds.iter().map(|round| round[k]).collect()));
    let ([bare_median, bare_p99], [median, p99]) = (medians(&bare), medians(&served));
    let text = format!(
        "{} participants at once, {} answers each, none lost or doubled; milliseconds\n{:24}{:>8}{:>8}\n\
         {:24}{median:8.1}{p99:8.1}\n{:24}{bare_median:8.1}{bare_p99:8.1}\nratio of the 99 % {:.2}",
        args.participants,
        args.answers,
        "",
        "median",
        "99 %",
        "study serve",
        "bare route",
        p99 / bare_p99
    );
    let facts = json!({
        "participants": args.participants, "answers": args.answers, "median_ms": median, "p99_ms": p99,
        "bare_median_ms": bare_median, "bare_p99_ms": bare_p99, "ratio": p99 / bare_p99,
    });
    Ok(Report { text, facts })
}

fn study_server(args: &Args) -> Result<Quantiles> {
    let study = MadeStudy::new(args.participants, args.participants, args.answers, FRAMES);
    let served = study.serve(&[]);
    let clients = (0..args.participants).map(|participant| {
        let mut client = Client::new();
        client.begin(&served.address, &format!("p{participant}")).context("the server does not respond")?;
        Ok(client_of(args, "Authorization", &format!("Bearer {}", client.token)))
    });
    let quantiles = load(args, &served.address, clients.collect::<Result<_>>()?)?;
    let votes = study.exported("votes");
    let mut answered: Vec<String> =
        votes.iter().map(|vote| format!("{} {}", vote["participant"], vote["trial"])).collect();
    answered.sort();
    answered.dedup();
    let expected = args.participants * args.answers;
    ensure!(
        votes.len() == expected && answered.len() == expected,
        "{} of {expected} answers are stored",
        answered.len()
    );
    Ok(quantiles)
}

fn bare_route(args: &Args) -> Result<Quantiles> {
    let dir = tempfile::tempdir()?;
    let db = database::open(&dir.path().join("bare.sqlite"), "bare")?;
    db.pragma_update(None, "foreign_keys", false)?;
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let listener = runtime.block_on(tokio::net::TcpListener::bind("127.0.0.1:0"))?;
    let address = listener.local_addr()?.to_string();
    let router = Router::new().route("/api/answer", post(insert)).with_state(Arc::new(Mutex::new(db)));
    runtime.spawn(async move { axum::serve(listener, router).await });
    let clients = (0..args.participants).map(|id| client_of(args, "participant", &format!("{id:024x}")));
    let quantiles = load(args, &address, clients.collect());
    runtime.shutdown_background();
    quantiles
}

async fn insert(State(db): State<Arc<Mutex<Connection>>>, headers: HeaderMap, body: Bytes) -> StatusCode {
    let id = headers.get("participant").and_then(|id| id.to_str().ok()).unwrap_or_default();
    let Ok(answer) = serde_json::from_slice(&body) else { return StatusCode::BAD_REQUEST };
    let written = tokio::task::block_in_place(|| db.lock().map(|db| answers::insert(&db, id, &answer)));
    if matches!(written, Ok(Ok(()))) { StatusCode::OK } else { StatusCode::INTERNAL_SERVER_ERROR }
}

/// Client of the load generator: its headers and the bodies of all its answers.
fn client_of(args: &Args, header: &str, value: &str) -> Value {
    let bodies = (0..args.answers).map(|position| answer(position, &fitting(position, true)).to_string());
    json!({
        "headers": { "Content-Type": "application/json", header: value },
        "bodies": bodies.collect::<Vec<_>>(),
    })
}

/// Sends the requests of all clients to `address`; each must be answered with status 200.
fn load(args: &Args, address: &str, clients: Vec<Value>) -> Result<Quantiles> {
    let dir = tempfile::tempdir()?;
    let plan = dir.path().join("plan.json");
    std::fs::write(&plan, json!({ "url": format!("http://{address}/api/answer"), "clients": clients }).to_string())?;
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/reference/study_load.mjs");
    let loader = args.loader.clone().or_else(|| Some(std::env::var_os("ORATOR_LOADER")?.into()));
    let loader = std::path::absolute(loader.unwrap_or_else(|| "target/loader".into()))?;
    let mut node = Command::new("node");
    let node = node.arg(script).arg(plan).env("ORATOR_LOADER", loader).stdin(Stdio::null()).stderr(Stdio::inherit());
    let output = node.output().context("node did not start")?;
    let result: Value =
        serde_json::from_slice(&output.stdout).context("autocannon is not installed (`make loader`)")?;
    let expected = args.participants * args.answers;
    let succeeded = result["statuses"] == json!({ "200": expected }) && result["errors"] == 0;
    ensure!(succeeded, "expected {expected} x status 200: {}, errors {}", result["statuses"], result["errors"]);
    let times: Vec<f64> = serde_json::from_value(result["times"].clone())?;
    Ok([0.5, 0.99].map(|quantile| times[((quantile * times.len() as f64) as usize).min(times.len() - 1)]))
}
