//! `orator study` and its verbs, among them `serve` and `export`.

use super::{analyse, build, plan};
use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::Result;
use orator_base::text::counted;
use orator_study::export::{TableForm, export};
use orator_study::folder::StudyFolder;
use orator_study::server::study_server::StudyServer;
use serde_json::json;
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;

/// Build, serve and analyse a user study.
///
/// A study file (STUDY.toml) defines the compared motion, the questions, the number of participants and the
/// hypotheses; see `orator guide study`.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    verb: StudyVerb,
}

#[derive(clap::Subcommand)]
enum StudyVerb {
    Plan(plan::Args),
    Build(build::Args),
    Serve(ServeArgs),
    Export(ExportArgs),
    Analyse(analyse::Args),
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    match args.verb {
        StudyVerb::Plan(args) => plan::run(&args, ui),
        StudyVerb::Build(args) => build::run(&args, ui),
        StudyVerb::Serve(args) => serve(&args, ui),
        StudyVerb::Export(args) => export_tables(&args, ui),
        StudyVerb::Analyse(args) => analyse::run(&args, ui),
    }
}

/// Serve a built study to its participants until Ctrl-C.
///
/// Each answer is stored in DIR/responses.sqlite before it is acknowledged; a stopped or killed server continues from
/// there. Addresses of participants and browser identifiers are not stored. The server speaks HTTP only: for remote
/// participants, run a TLS reverse proxy (caddy, nginx) on the same machine and give --host-name.
#[derive(clap::Args)]
struct ServeArgs {
    /// Folder of the built study.
    #[arg(value_name = "DIR")]
    dir: PathBuf,
    /// IP address to listen on; a loopback address is reachable from this machine only.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1", value_parser = ip_address)]
    listen: IpAddr,
    /// Port to listen on; 0 selects a free one.
    #[arg(long, default_value_t = 8080)]
    port: u16,
    /// Host name under which a proxy serves the study, such as study.example.org; may be repeated. Requests for any
    /// host other than these and the listened address are answered with status 421. Connections from loopback and
    /// private addresses, such as those of the proxy, are then not limited in number.
    #[arg(long = "host-name", value_name = "NAME")]
    host_names: Vec<String>,
    /// Time without an answer after which the session of a participant is given to another, minutes; before the first
    /// answer at most 5 minutes plus twice the length of the films.
    #[arg(long, value_name = "MINUTES", default_value_t = 60)]
    abandoned_after: u32,
}

fn ip_address(text: &str) -> std::result::Result<IpAddr, String> {
    text.parse().map_err(|_| match (text.parse::<SocketAddr>(), text.rsplit_once(':')) {
        (Ok(socket), _) => format!("the port is a separate option: --listen {} --port {}", socket.ip(), socket.port()),
        (Err(_), Some((host, port))) if !host.contains(':') => {
            format!(
                "expected an IP address, such as 127.0.0.1 for {host:?}; the port is a separate option: --port {port}"
            )
        }
        (Err(_), _) => {
            "expected an IP address, such as 127.0.0.1 (this machine only) or 0.0.0.0 (all networks)".to_owned()
        }
    })
}

fn serve(args: &ServeArgs, ui: &Ui) -> Result<Outcome> {
    let folder = StudyFolder::new(&args.dir);
    let abandoned_secs = 60.0 * f64::from(args.abandoned_after);
    let server = StudyServer::open(&folder, abandoned_secs)?;
    let title = server.study().title.clone();
    let (n_sessions, n_films) = (server.study().plan.sessions.len(), server.study().n_films());
    let counts = format!("{}, {}", counted(n_sessions, "session"), counted(n_films, "film"));
    let token = server.operator_token().to_owned();
    server.run(SocketAddr::new(args.listen, args.port), &args.host_names, |address| {
        let page = format!("http://{address}/");
        let text = format!("{title}: {counts}\nparticipants: {page}\noperator:     {page}operator, token {token}");
        let facts = json!({ "address": page, "operator_address": format!("{page}operator"), "operator_token": token });
        ui.summary(&text, None, facts);
    })?;
    Ok(Outcome::Done)
}

/// Export the responses of a study as tables.
///
/// This also works while the study is being served. `votes` has a row per answered trial: participant, task, design,
/// phase, trial (from 1), clip, speaker, conditions (from left to right), response and expected (left or right; real
/// or generated; -2 to 2; scores; a number), stalled_secs, unfocused_secs, response_secs, plays, reloads (after a film
/// began), completed.
///
/// `participants` has a row per participant: participant, place, language, status (active, completed, replaced),
/// answers, failed_checks, begun_ms (Unix time, milliseconds), code, and the parameters passed by the recruiting
/// site. Several values in a cell are joined by |.
#[derive(clap::Args)]
struct ExportArgs {
    /// Folder of the built study.
    #[arg(value_name = "DIR")]
    dir: PathBuf,
    /// Table format: CSV with a header, or JSON Lines.
    #[arg(long, value_parser = ["csv", "jsonl"], default_value = "csv")]
    format: String,
    /// Output folder; defaults to DIR/export.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

fn export_tables(args: &ExportArgs, ui: &Ui) -> Result<Outcome> {
    let form = if args.format == "csv" { TableForm::Csv } else { TableForm::Jsonl };
    let out = args.out.clone().unwrap_or_else(|| args.dir.join("export"));
    let exported = export(&StudyFolder::new(&args.dir), form, &out)?;
    let [votes, participants] = [&exported.votes, &exported.participants].map(|path| path.display());
    let (n_votes, n_persons) = (counted(exported.n_votes, "vote"), counted(exported.n_participants, "participant"));
    let text = format!("{n_votes} of {n_persons}: {votes}, {participants}");
    let next = format!("orator study analyse {}", args.dir.display());
    ui.summary(&text, Some(&next), json!(exported));
    Ok(Outcome::Done)
}

#[cfg(test)]
mod tests {
    use super::ip_address;

    #[test]
    fn an_address_with_a_port_is_answered_with_the_options() {
        assert!(ip_address("::1").is_ok() && ip_address("0.0.0.0").is_ok());
        for (text, expected) in [
            ("127.0.0.1:8080", "--listen 127.0.0.1 --port 8080"),
            ("[::1]:80", "--listen ::1 --port 80"),
            ("localhost:9000", "--port 9000"),
            ("localhost", "expected an IP address, such as 127.0.0.1"),
        ] {
            let error = ip_address(text).unwrap_err();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
