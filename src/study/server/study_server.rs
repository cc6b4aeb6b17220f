//! Opens, runs and shuts down a study's server; routes of its API and pages. The clock for all times that the server
//! stores and compares: corrections of the wall clock, even across a restart, neither block participants nor end their
//! sessions.

use super::host::{AllowedHosts, check_host};
use super::limits::RateLimits;
use super::reply::{HEADERS, method_not_allowed, not_found, text_reply};
use super::secret::StudySecret;
use super::served_study::ServedStudy;
use super::{api, listen};
use crate::folder::StudyFolder;
use crate::pages::assets::ASSETS;
use crate::seal::StudySeal;
use crate::store::database::{self, ResponseStore};
use crate::store::participants;
use anyhow::{Context, Result};
use axum::extract::DefaultBodyLimit;
use axum::http::{HeaderValue, StatusCode, header};
use axum::routing::{get, post};
use axum::{Router, middleware};
use std::net::SocketAddr;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};
use tower_http::set_header::SetResponseHeaderLayer;
use tower_http::timeout::TimeoutLayer;

/// Maximum size of a request body, bytes.
const MAX_BODY_BYTES: usize = 16 * 1024;
/// Time limit for a request up to the start of its reply, including reading the body.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(10);

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
        let is_proxied = !host_names.is_empty();
        let hosts = AllowedHosts::new(address.ip(), host_names)?;
        let runtime =
            tokio::runtime::Builder::new_multi_thread().enable_all().build().context("cannot start threads")?;
        let router = router(self.app, hosts);
        runtime.block_on(async {
            let mut terminated = signal(SignalKind::terminate()).context("cannot install the SIGTERM handler")?;
            let listener = TcpListener::bind(address).await;
            let listener = listener.with_context(|| format!("cannot listen on {address}; use another --port"))?;
            on_listening(listener.local_addr()?);
            let stop = async {
                tokio::select! {
                    _ = tokio::signal::ctrl_c() => {}
                    _ = terminated.recv() => {}
                }
            };
            listen::serve(listener, router, is_proxied, stop).await;
            anyhow::Ok(())
        })?;
        drop(runtime);
        // Dropping the runtime dropped the last handle of the store, so its thread ends after the queued work.
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
    let no_store = HeaderValue::from_static("no-store");
    let mut router = router
        .fallback(not_found)
        .method_not_allowed_fallback(method_not_allowed)
        .layer(DefaultBodyLimit::max(MAX_BODY_BYTES))
        .layer(TimeoutLayer::with_status_code(StatusCode::REQUEST_TIMEOUT, REQUEST_TIMEOUT))
        .layer(middleware::from_fn_with_state(Arc::new(hosts), check_host))
        .layer(SetResponseHeaderLayer::if_not_present(header::CACHE_CONTROL, no_store));
    for (name, value) in HEADERS {
        router = router.layer(SetResponseHeaderLayer::overriding(name, HeaderValue::from_static(value)));
    }
    router.with_state(Arc::new(app))
}

/// Clock that reads the wall clock once at the start and is monotonic afterwards.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    start_ms: i64,
    started: Instant,
}

impl Clock {
    /// Starts at the wall clock's time or at `latest_ms` (the latest stored time, milliseconds since 1970), whichever
    /// is later.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_continues_from_the_wall_clock_or_the_latest_stored_time() {
        let wall_ms = Clock::start(0).now_ms();
        assert!(wall_ms > 1_700_000_000_000, "{wall_ms}");
        let ahead_ms = wall_ms + 3_600_000;
        let clock = Clock::start(ahead_ms);
        std::thread::sleep(Duration::from_millis(20));
        let now_ms = clock.now_ms();
        assert!((ahead_ms + 20..ahead_ms + 60_000).contains(&now_ms), "{now_ms}");
        assert_eq!(Clock::start(i64::MAX).now_ms(), i64::MAX);
    }
}
