//! Opens, runs and shuts down a study's server; routes of its API and pages; the sessions, films and texts that it
//! serves. The clock for all times that the server stores and compares: corrections of the wall clock, even across a
//! restart, neither block participants nor end their sessions.

use super::api;
use super::limits::RateLimits;
use super::secret::StudySecret;
use crate::file::StudyFile;
use crate::folder::{StudyFolder, read_json};
use crate::pages::assets::{ASSETS, page_texts};
use crate::plan::{PlannedTask, StudyPlan, TaskDesign, Trial, TrialPhase};
use crate::seal::StudySeal;
use crate::store::database::{self, ResponseStore};
use crate::store::participants::{self, Quota};
use anyhow::{Context, Result, ensure};
use orator_base::stage::fingerprint::hash_file;
use orator_media::ffmpeg::probe::probe;
use orator_web::axum::Router;
use orator_web::axum::extract::DefaultBodyLimit;
use orator_web::axum::routing::{get, post};
use orator_web::host::AllowedHosts;
use orator_web::reply::text_reply;
use orator_web::server::secured;
use serde_json::json;
use std::collections::{BTreeSet, HashMap};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

/// Maximum size of a request body, bytes.
const MAX_BODY_BYTES: usize = 16 * 1024;
/// Time limit for a request up to the start of its reply, including reading the body.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(10);

/// Content security policy: no external resources.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; media-src 'self'; connect-src 'self'; \
    img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
const MISDIRECTED: &str = "Open the address that `orator study serve` printed. To allow another host name, such as that \
    of a proxy, start the server with --host-name NAME.";

/// State shared by the request handlers.
pub struct App {
    pub study: ServedStudy,
    pub store: ResponseStore,
    pub secret: StudySecret,
    pub limits: RateLimits,
    pub clock: Clock,
}

/// Server of one study that does not listen yet.
pub struct StudyServer {
    app: App,
    writer: JoinHandle<()>,
}

impl StudyServer {
    /// Opens the study in `folder`, its responses and its secret. `abandoned_secs`: time without an answer after which
    /// a session may be reassigned.
    ///
    /// # Errors
    /// The study does not match its seal, or its secret or responses are unusable or belong to another plan.
    pub fn open(folder: &StudyFolder, abandoned_secs: f64) -> Result<Self> {
        StudySeal::verify(folder)?;
        let study = ServedStudy::open(folder, abandoned_secs)?;
        let secret = StudySecret::open(&folder.secret())?;
        let (store, writer) = ResponseStore::open(&folder.responses(), &study.plan_hash)?;
        let latest_ms = participants::latest_ms(&database::open_for_reading(&folder.responses())?)?;
        let (limits, clock) = (RateLimits::new(), Clock::start(latest_ms));
        Ok(Self { app: App { study, store, secret, limits, clock }, writer })
    }

    pub fn study(&self) -> &ServedStudy {
        &self.app.study
    }

    pub fn operator_token(&self) -> &str {
        self.app.secret.operator_token()
    }

    /// Serves on `address` until SIGINT or SIGTERM. `on_listening` is called with the actual address once the socket is
    /// bound. `host_names`: names under which a proxy serves the study; a proxy at a loopback or private address is
    /// then responsible for limiting the connections of each peer.
    ///
    /// # Errors
    /// The address cannot be bound, or one of `host_names` is more than a host name.
    pub fn run(self, address: SocketAddr, host_names: &[String], on_listening: impl FnOnce(SocketAddr)) -> Result<()> {
        let hosts = AllowedHosts::new(address.ip(), host_names, MISDIRECTED)?;
        let is_proxied = !host_names.is_empty();
        orator_web::server::run(router(self.app, hosts), address, is_proxied, on_listening)?;
        // The server dropped the last handle of the store, so its thread ends after the queued work.
        let _ = self.writer.join();
        Ok(())
    }
}

fn router(app: App, hosts: AllowedHosts) -> Router {
    let mut router = Router::new()
        .route("/api/study", get(api::study))
        .route("/api/begin", post(api::begin))
        .route("/api/state", get(api::state))
        .route("/api/start", post(api::start))
        .route("/api/answer", post(api::answer))
        .route("/api/withdraw", post(api::withdraw))
        .route("/api/operator", get(api::operator))
        .route("/films/{name}", get(api::film));
    for (path, content_type, text) in ASSETS {
        router = router.route(path, get(async move || text_reply(content_type, text)));
    }
    let router = router.with_state(Arc::new(app)).layer(DefaultBodyLimit::max(MAX_BODY_BYTES));
    let permissions = "camera=(), microphone=(), geolocation=(), display-capture=(), usb=()";
    secured(router, hosts, [POLICY, permissions], REQUEST_TIMEOUT)
}

/// Clock that reads the wall clock once at the start and is monotonic afterwards.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    start_ms: i64,
    started: Instant,
}

impl Clock {
    /// Starts at the wall clock or `latest_ms` (the latest stored time, milliseconds since 1970), whichever is later.
    pub fn start(latest_ms: i64) -> Self {
        let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        let wall_ms = since.map_or(0, |since| since.as_millis() as i64);
        Self { start_ms: wall_ms.max(latest_ms), started: Instant::now() }
    }

    /// Milliseconds since 1970.
    pub fn now_ms(&self) -> i64 {
        self.start_ms.saturating_add(self.started.elapsed().as_millis() as i64)
    }
}

/// Tolerance for an answer before the nominal end of its films, milliseconds: players round durations.
const END_TOLERANCE_MS: f64 = 250.0;
/// Time limit for the first answer in addition to twice the length of its films, milliseconds: it includes reading the
/// task's instructions and loading the films. Consent and the sound check precede the start of a session.
const UNANSWERED_MS: i64 = 300_000;

#[derive(Clone, Debug, PartialEq)]
pub struct ServedFilm {
    pub path: PathBuf,
    secs: f64,
}

#[derive(Debug)]
pub struct ServedStudy {
    pub title: String,
    pub languages: Vec<String>,
    pub plan: StudyPlan,
    /// BLAKE3 hash of the plan file.
    pub plan_hash: String,
    pub quota: Quota,
    /// Whether starting requires the participant ID of a recruiting site.
    pub requires_id: bool,
    /// URL to which a participant returns at the end.
    pub return_url: Option<String>,
    /// Texts and tasks in the form that the page reads.
    pub page: serde_json::Value,
    films: HashMap<String, ServedFilm>,
}

impl ServedStudy {
    /// Reads the study in `folder`. `abandoned_secs`: time without an answer after which a session may be reassigned.
    ///
    /// # Errors
    /// A file is missing or unreadable, or the plan refers to a task or film that does not exist.
    pub fn open(folder: &StudyFolder, abandoned_secs: f64) -> Result<Self> {
        let file = StudyFile::read(&folder.study_file())?;
        let plan: StudyPlan = read_json(&folder.plan())?;
        let plan_hash = hash_file(&folder.plan())?;
        let trials = || plan.sessions.iter().flat_map(|session| &session.trials);
        let is_known = |trial: &Trial| trial.task < plan.tasks.len() && !trial.films.is_empty();
        ensure!(
            trials().all(is_known),
            "{}: a trial has no films or refers to an unknown task",
            folder.plan().display()
        );
        let sound_check = Some(&plan.sound_check).filter(|film| !film.is_empty());
        let names: BTreeSet<&String> = trials().flat_map(|trial| &trial.films).chain(sound_check).collect();
        let films = names.into_iter().map(|name| Ok((name.clone(), open_film(&folder.film(name), name)?)));
        let films = films.collect::<Result<_>>()?;
        let quota = Quota {
            n_sessions: u32::try_from(plan.sessions.len()).context("too many sessions")?,
            target: u32::try_from(file.participants).context("too many participants")?,
            excluded_from: file.exclusion.failed_checks,
            abandoned_ms: (1000.0 * abandoned_secs) as i64,
            unanswered_ms: UNANSWERED_MS,
        };
        let page = json!({
            "title": file.title,
            "languages": file.languages,
            "texts": page_texts(&file.languages, &file.texts),
            "tasks": plan.tasks,
            "has_checks": trials().any(|trial| trial.phase == TrialPhase::AttentionCheck),
            "n_trials": plan.sessions.first().map_or(0, |session| session.trials.len()),
            "sound_check": sound_check,
        });
        let (title, languages, return_url) = (file.title, file.languages, file.return_url);
        let requires_id = file.require_id;
        let mut study = Self { title, languages, plan, plan_hash, quota, requires_id, return_url, page, films };
        let first_trials = study.plan.sessions.iter().filter_map(|session| session.trials.first());
        let first_ms = first_trials.map(|trial| study.min_ms(trial)).max().unwrap_or(0);
        study.quota.unanswered_ms += 2 * first_ms;
        Ok(study)
    }

    /// Film with this opaque name; no other file can be requested.
    pub fn film(&self, name: &str) -> Option<&ServedFilm> {
        self.films.get(name)
    }

    pub fn n_films(&self) -> usize {
        self.films.len()
    }

    /// Trials of a session in order; empty for an unknown session.
    pub fn trials(&self, session: u32) -> &[Trial] {
        self.plan.sessions.get(session as usize).map_or(&[], |session| &session.trials)
    }

    /// Task of a trial. Panics if the trial is not from the plan.
    pub fn task(&self, trial: &Trial) -> &PlannedTask {
        &self.plan.tasks[trial.task]
    }

    /// Minimum time to watch the films of a trial, milliseconds: up to two films play together; those of sliders, and
    /// more than two, play one after another.
    pub fn min_ms(&self, trial: &Trial) -> i64 {
        let is_rated = self.task(trial).design == TaskDesign::Sliders && trial.phase != TrialPhase::AttentionCheck;
        let secs = trial.films.iter().filter_map(|film| self.film(film)).map(|film| film.secs);
        let secs = if is_rated || trial.films.len() > 2 { secs.sum() } else { secs.fold(0.0, f64::max) };
        (1000.0 * secs - END_TOLERANCE_MS).max(0.0) as i64
    }
}

fn open_film(path: &Path, name: &str) -> Result<ServedFilm> {
    let is_opaque = name.len() == 16 && name.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'));
    ensure!(is_opaque, "invalid film name {name:?} in the plan: expected 16 hexadecimal digits");
    let secs = probe(path)?.duration_secs.with_context(|| format!("{} does not state its duration", path.display()))?;
    Ok(ServedFilm { path: path.to_owned(), secs })
}
