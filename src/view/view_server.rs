//! Server of the viewer and its routes. All of them are below `/TOKEN/`, a random word in the URL that the program
//! prints, so that other users and pages of other origins reach none.

use crate::assets::ASSETS;
use crate::file::ViewedFile;
use crate::live::LiveFeed;
use crate::project::{DecisionRequest, Project};
use crate::results::{ResultRequest, Results};
use crate::training;
use crate::video::VideoView;
use anyhow::{Result, ensure};
use orator_base::stage::workdir::BusyFolder;
use orator_gesture::generate::model::checkpoint_file;
use orator_web::axum::Router;
use orator_web::axum::extract::{Path, Query, Request, State};
use orator_web::axum::http::{StatusCode, header};
use orator_web::axum::response::{IntoResponse, Response as HttpResponse, Sse};
use orator_web::axum::routing::{delete, get, post};
use orator_web::files::{hex, random, save_body, serve_file};
use orator_web::host::AllowedHosts;
use orator_web::reply::{ApiError, JsonBody, json_reply, text_reply};
use orator_web::server::secured;
use serde::Deserialize;
use serde_json::{Value, json};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::Semaphore;

/// Content security policy: everything from this server; `blob:` for files that the user drops on the page.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; media-src 'self' blob:; \
    connect-src 'self' blob: data:; img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; \
    frame-ancestors 'none'";
const PERMISSIONS: &str = "camera=(), microphone=(self), geolocation=(), display-capture=(), usb=()";
const MISDIRECTED: &str = "Open the address that the program printed.";
/// Time limit for a request up to the start of its reply, including reading an uploaded sound.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(600);
/// Number of requests that read the arrays of a video at the same time, which bounds memory.
const MAX_READERS: usize = 2;

/// What the page shows and allows.
pub struct ViewRequest {
    pub project: Option<Project>,
    pub file: Option<ViewedFile>,
    pub live: Option<LiveFeed>,
    /// Author of decisions; `None`: the page is read-only.
    pub author: Option<String>,
    /// This program.
    pub program: PathBuf,
}

/// State shared by the request handlers.
struct Viewer {
    request: ViewRequest,
    /// Of a project.
    results: Option<Results>,
    readers: Arc<Semaphore>,
}

type Shared = State<Arc<Viewer>>;
type Reply = Result<HttpResponse, ApiError>;

/// Serves the page on `address`, a loopback address, until SIGINT or SIGTERM. `on_listening` is called with the URL.
///
/// # Errors
/// The address is not a loopback address or cannot be bound.
pub fn run(request: ViewRequest, address: SocketAddr, on_listening: impl FnOnce(&str)) -> Result<()> {
    ensure!(address.ip().is_loopback(), "{} is not a loopback address", address.ip());
    let token = hex(&random::<16>()?);
    let hosts = AllowedHosts::new(address.ip(), &[], MISDIRECTED)?;
    let results = request.project.as_ref().map(|_| Results::start(request.program.clone())).transpose()?;
    let readers = Arc::new(Semaphore::new(MAX_READERS));
    let router = router(Viewer { request, results, readers }, &token);
    let router = secured(router, hosts, [POLICY, PERMISSIONS], REQUEST_TIMEOUT);
    orator_web::server::run(router, address, false, |address| on_listening(&format!("http://{address}/{token}/")))
}

fn router(viewer: Viewer, token: &str) -> Router {
    let mut pages = Router::new()
        .route("/api/project", get(project))
        .route("/api/videos", get(videos))
        .route("/api/videos/{speaker}/{name}", get(video))
        .route("/api/videos/{speaker}/{name}/wave", get(wave))
        .route("/api/videos/{speaker}/{name}/keypoints", get(keypoints))
        .route("/api/videos/{speaker}/{name}/avatar.glb", get(avatar))
        .route("/media/{speaker}/{name}", get(media))
        .route("/api/stages", get(stages))
        .route("/api/trainings", get(trainings))
        .route("/api/training", get(curves))
        .route("/api/pair", post(pair))
        .route("/api/checkpoints", get(checkpoints))
        .route("/api/decisions", post(decide))
        .route("/api/decisions/{id}", delete(undo))
        .route("/api/results", get(results).post(generate))
        .route("/api/results/{id}/video", post(film))
        .route("/results/{id}/{file}", get(result_file))
        .route("/live/avatar.vrm", get(live_avatar))
        .route("/live/poses", get(live_poses))
        .route("/file", get(file))
        .route("/file-audio", get(file_audio));
    for (path, content_type, text) in ASSETS {
        pages = pages.route(path, get(async move || text_reply(content_type, text)));
    }
    let page = get(async || text_reply("text/html; charset=utf-8", include_str!("page/page.html")));
    let router = Router::new().route(&format!("/{token}/"), page).nest(&format!("/{token}"), pages);
    router.with_state(Arc::new(viewer))
}

/// Runs `work` on a thread that may block. Its errors are shown to the user: status 409 if another program uses a
/// folder, 500 if a file cannot be read or written, otherwise 400.
async fn blocking<T: Send + 'static>(work: impl FnOnce() -> Result<T> + Send + 'static) -> Result<T, ApiError> {
    let Ok(done) = tokio::task::spawn_blocking(work).await else {
        return Err(ApiError::new(StatusCode::INTERNAL_SERVER_ERROR, "The request failed; see the terminal."));
    };
    done.map_err(|error| {
        let is = |found: fn(&(dyn std::error::Error + 'static)) -> bool| error.chain().any(found);
        let status = if is(|cause| cause.is::<BusyFolder>()) {
            StatusCode::CONFLICT
        } else if is(|cause| cause.is::<std::io::Error>()) {
            StatusCode::INTERNAL_SERVER_ERROR
        } else {
            StatusCode::BAD_REQUEST
        };
        ApiError::new(status, format!("{error:#}"))
    })
}

/// JSON that `work` reads from the project.
async fn of_project(viewer: Arc<Viewer>, work: impl FnOnce(&Project) -> Result<Value> + Send + 'static) -> Reply {
    let value = blocking(move || viewer.request.project.as_ref().map(work).transpose()).await?;
    value.map(|value| json_reply(&value)).ok_or_else(unknown)
}

fn unknown() -> ApiError {
    ApiError::new(StatusCode::NOT_FOUND, "The project has no such item.")
}

async fn project(State(viewer): Shared) -> HttpResponse {
    let ViewRequest { project, file, live, author, .. } = &viewer.request;
    let mut facts = project.as_ref().map_or_else(|| json!({ "speakers": [] }), Project::facts);
    facts["file"] = file.as_ref().map_or(Value::Null, ViewedFile::facts);
    facts["live"] = live.as_ref().map_or(Value::Null, LiveFeed::facts);
    facts["editable"] = (project.is_some() && author.is_some()).into();
    facts["author"] = json!(author);
    json_reply(&facts)
}

async fn videos(State(viewer): Shared) -> Reply {
    of_project(viewer, Project::videos).await
}

async fn stages(State(viewer): Shared) -> Reply {
    of_project(viewer, Project::stages).await
}

async fn trainings(State(viewer): Shared) -> Reply {
    of_project(viewer, |project| training::trainings(project.work())).await
}

async fn checkpoints(State(viewer): Shared) -> Reply {
    of_project(viewer, |project| Ok(training::checkpoints(project.work()))).await
}

/// What `work` reads from a video.
async fn of_video<T: Send + 'static>(
    viewer: Arc<Viewer>,
    Path((speaker, name)): Path<(String, String)>,
    work: impl FnOnce(&VideoView) -> Result<T> + Send + 'static,
) -> Result<T, ApiError> {
    let permit = viewer.readers.clone().acquire_owned().await;
    let found = blocking(move || {
        let _permit = permit;
        let Some(project) = &viewer.request.project else { return Ok(None) };
        project.video(&speaker, &name)?.as_ref().map(work).transpose()
    });
    found.await?.ok_or_else(unknown)
}

type VideoPath = Path<(String, String)>;

async fn video(State(viewer): Shared, path: VideoPath) -> Reply {
    Ok(json_reply(&of_video(viewer, path, |video| Ok(video.facts())).await?))
}

async fn wave(State(viewer): Shared, path: VideoPath) -> Reply {
    Ok(bytes(of_video(viewer, path, VideoView::wave).await?))
}

#[derive(Deserialize)]
struct FrameRange {
    start: usize,
    n: usize,
}

async fn keypoints(State(viewer): Shared, path: VideoPath, Query(range): Query<FrameRange>) -> Reply {
    Ok(bytes(of_video(viewer, path, move |video| video.keypoints(range.start, range.n)).await?))
}

#[derive(Deserialize)]
struct SecondRange {
    start_secs: f64,
    end_secs: f64,
}

async fn avatar(State(viewer): Shared, path: VideoPath, Query(range): Query<SecondRange>) -> Reply {
    let SecondRange { start_secs, end_secs } = range;
    Ok(bytes(of_video(viewer, path, move |video| video.avatar(start_secs, end_secs)).await?))
}

fn bytes(bytes: Vec<u8>) -> HttpResponse {
    ([(header::CONTENT_TYPE, "application/octet-stream"), (header::CACHE_CONTROL, "no-store")], bytes).into_response()
}

async fn media(State(viewer): Shared, Path((speaker, name)): VideoPath, request: Request) -> Reply {
    let source = blocking(move || {
        let project = viewer.request.project.as_ref();
        project.map_or(Ok(None), |project| project.film(&speaker, &name))
    });
    Ok(serve_file(&source.await?.ok_or_else(unknown)?, request).await)
}

#[derive(Deserialize)]
struct TrainingQuery {
    name: String,
    after: Option<u64>,
}

async fn curves(State(viewer): Shared, Query(query): Query<TrainingQuery>) -> Reply {
    of_project(viewer, move |project| training::curves(project.work(), &query.name, query.after)).await
}

/// Generated and true motion of a clip of the speaker's dataset, by the newest checkpoint.
async fn pair(State(viewer): Shared, Query(query): Query<TrainingQuery>) -> Reply {
    let results = results_of(&viewer)?.clone();
    of_project(viewer, move |project| {
        let checkpoint_file = training::newest_checkpoint(project.work(), &query.name)?;
        let (speaker, dataset) = training::dataset(project.work(), &query.name, &checkpoint_file)?;
        let (checkpoint, name) = (query.name, "speech.wav".to_owned());
        let pending = results.add(ResultRequest { checkpoint, checkpoint_file, seed: None, speaker, name })?;
        Ok(json!({ "id": pending.pair(dataset) }))
    })
    .await
}

/// Author of decisions; an error if the page is read-only.
fn author(viewer: &Viewer) -> Result<String, ApiError> {
    let sentence = "The page is read-only: start `orator view` with --edit.";
    viewer.request.author.clone().ok_or_else(|| ApiError::new(StatusCode::FORBIDDEN, sentence))
}

async fn decide(State(viewer): Shared, body: Result<JsonBody<DecisionRequest>, ApiError>) -> Reply {
    let (author, JsonBody(request)) = (author(&viewer)?, body?);
    of_project(viewer, move |project| project.decide(request, &author)).await
}

async fn undo(State(viewer): Shared, Path(id): Path<String>) -> Reply {
    author(&viewer)?;
    let removed = blocking(move || viewer.request.project.as_ref().map_or(Ok(false), |project| project.undo(&id)));
    if removed.await? { Ok(json_reply(&json!({ "removed": true }))) } else { Err(unknown()) }
}

#[derive(Deserialize)]
struct GenerateQuery {
    checkpoint: String,
    seed: Option<u64>,
    speaker: Option<String>,
    name: String,
}

/// Generates motion for the sound in the body.
async fn generate(State(viewer): Shared, Query(query): Query<GenerateQuery>, request: Request) -> Reply {
    let added = blocking(move || {
        let Some(project) = &viewer.request.project else { return Ok(None) };
        let GenerateQuery { checkpoint, seed, speaker, name } = query;
        let checkpoint_file = checkpoint_file(&training::folder(project.work(), &checkpoint)?)?;
        let request = ResultRequest { checkpoint, checkpoint_file, seed, speaker, name };
        viewer.results.as_ref().map(|results| results.add(request)).transpose()
    });
    let pending = added.await?.ok_or_else(unknown)?;
    save_body(request, &pending.sound).await?;
    Ok(json_reply(&json!({ "id": pending.generate() })))
}

fn results_of(viewer: &Viewer) -> Result<&Results, ApiError> {
    viewer.results.as_ref().ok_or_else(unknown)
}

async fn results(State(viewer): Shared) -> Reply {
    Ok(json_reply(&results_of(&viewer)?.facts()))
}

async fn film(State(viewer): Shared, Path(id): Path<String>) -> Reply {
    if results_of(&viewer)?.film(&id) { Ok(json_reply(&json!({ "queued": true }))) } else { Err(unknown()) }
}

async fn result_file(State(viewer): Shared, Path((id, file)): Path<(String, String)>, request: Request) -> Reply {
    let path = results_of(&viewer)?.file(&id, &file).ok_or_else(unknown)?;
    Ok(serve_file(&path, request).await)
}

fn live_feed(viewer: &Viewer) -> Result<&LiveFeed, ApiError> {
    viewer.request.live.as_ref().ok_or_else(unknown)
}

async fn live_avatar(State(viewer): Shared) -> Reply {
    Ok(bytes(live_feed(&viewer)?.avatar.to_vec()))
}

async fn live_poses(State(viewer): Shared) -> Reply {
    Ok(Sse::new(live_feed(&viewer)?.events()).into_response())
}

async fn file(State(viewer): Shared, request: Request) -> Reply {
    let file = viewer.request.file.as_ref().ok_or_else(unknown)?;
    Ok(serve_file(&file.path, request).await)
}

async fn file_audio(State(viewer): Shared, request: Request) -> Reply {
    let sound = viewer.request.file.as_ref().and_then(|file| file.sound.as_ref()).ok_or_else(unknown)?;
    Ok(serve_file(sound, request).await)
}
