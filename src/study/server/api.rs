//! HTTP API of the pages: a participant begins, answers trial by trial and may withdraw; the operator sees the progress
//! of all participants. Films are served in full or in byte ranges.

use super::answer::{check, fails_check, feedback};
use super::secret::{completion_code, is_attempt, participant_id};
use super::study_server::{App, ServedStudy};
use crate::plan::TrialPhase;
use crate::store::answers::{self, RecordOutcome, SubmittedAnswer, TrialStart, TrialTerms, record};
use crate::store::database::NotStored;
use crate::store::participants::{self, BeginOutcome, NewParticipant, PARAMETERS, Participant, Status};
use crate::vote::Response;
use orator_web::axum::extract::{FromRequestParts, Path, Request, State};
use orator_web::axum::http::request::Parts;
use orator_web::axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use orator_web::axum::response::{IntoResponse, Response as HttpResponse};
use orator_web::files::serve_file;
use orator_web::reply::{ApiError, JsonBody, bearer_token, json_reply, not_found, unauthorized};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Maximum length of a recruiting site's parameter, bytes.
const MAX_PARAMETER_BYTES: usize = 128;

type Shared = State<Arc<App>>;

/// State of a participant's session as sent to the page.
#[derive(Serialize)]
struct SessionState<'a> {
    /// Number of answered trials.
    position: u32,
    n_trials: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    trial: Option<ShownTrial<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    completion: Option<Completion>,
}

#[derive(Serialize)]
struct ShownTrial<'a> {
    /// Index into the study's tasks.
    task: usize,
    phase: TrialPhase,
    films: &'a [String],
}

#[derive(Serialize)]
struct Completion {
    code: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    return_url: Option<String>,
}

fn session_state<'a>(study: &'a ServedStudy, participant: &Participant) -> SessionState<'a> {
    let trials = study.trials(participant.session);
    let trial = trials.get(participant.position as usize);
    let code = || participant.code.clone();
    SessionState {
        position: participant.position,
        n_trials: trials.len(),
        trial: trial.map(|trial| ShownTrial { task: trial.task, phase: trial.phase, films: &trial.films }),
        completion: trial.is_none().then(|| Completion {
            code: code(),
            return_url: study.return_url.as_ref().map(|url| url.replace("{code}", &code())),
        }),
    }
}

/// Participant who sent the request, identified by a token that this server signed, within the rate limit.
pub struct AuthenticatedSession {
    session: u32,
    id: String,
}

impl FromRequestParts<Arc<App>> for AuthenticatedSession {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, app: &Arc<App>) -> Result<Self, ApiError> {
        let (session, id) = app.secret.verify(bearer_token(&parts.headers)?).ok_or_else(unauthorized)?;
        if app.limits.allow_participant(&id) { Ok(Self { session, id }) } else { Err(ApiError::too_many_requests()) }
    }
}

fn gone() -> ApiError {
    let sentence = "This session has ended: it was reassigned after too long a pause, or restarted in another browser.";
    ApiError::new(StatusCode::GONE, sentence)
}

fn unknown() -> ApiError {
    let sentence = "This session is not stored: it was withdrawn, or was reassigned before its first answer.";
    ApiError::new(StatusCode::GONE, sentence)
}

/// `GET /api/study`
pub async fn study(State(app): Shared) -> HttpResponse {
    json_reply(&app.study.page)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartRequest {
    consent: bool,
    language: String,
    #[serde(default)]
    parameters: BTreeMap<String, String>,
    /// Random number of the page; a repeated request with it gets the same session.
    attempt: Option<String>,
}

/// `POST /api/begin`
pub async fn begin(State(app): Shared, JsonBody(body): JsonBody<StartRequest>) -> Result<HttpResponse, ApiError> {
    if !app.limits.allow_begin() {
        return Err(ApiError::too_many_requests());
    }
    if !body.consent {
        return Err(ApiError::bad_request("Consent is required to take part."));
    }
    if !app.study.languages.contains(&body.language) {
        return Err(ApiError::bad_request("The study is not available in this language."));
    }
    if !body.parameters.iter().all(|(name, value)| is_parameter(name, value)) {
        return Err(ApiError::bad_request(
            "A parameter is unknown, too long, or contains characters other than letters, digits and -_.:@.",
        ));
    }
    if body.attempt.as_deref().is_some_and(|attempt| !is_attempt(attempt)) {
        return Err(ApiError::bad_request("The field attempt must be 32 hexadecimal digits."));
    }
    let id_of = |attempt: &String| Ok(app.secret.id_of_attempt(attempt));
    let named = || anyhow::Ok((body.attempt.as_ref().map_or_else(participant_id, id_of)?, completion_code()?));
    let (id, code) = named().map_err(|_| NotStored)?;
    let new_participant = NewParticipant { id, language: body.language, parameters: body.parameters, code };
    if app.study.requires_id && !new_participant.has_id() {
        let sentence = "The participant ID of the recruiting site is missing from the address; open the study with \
            the link on that site.";
        return Err(ApiError::new(StatusCode::FORBIDDEN, sentence).with_reason("id-missing"));
    }
    let (quota, clock) = (app.study.quota, app.clock);
    let participant =
        match app.store.write(move |db| participants::begin(db, &new_participant, quota, clock.now_ms())).await? {
            BeginOutcome::Begun(participant) => participant,
            BeginOutcome::Replaced => return Err(gone()),
            BeginOutcome::Known => {
                let sentence = "This participant ID is already in use; continue in the browser in which you started. \
                    If you have not answered anything yet, you can start here in a few minutes.";
                return Err(ApiError::conflict(sentence).with_reason("known"));
            }
            BeginOutcome::Full => {
                return Err(ApiError::conflict("The study has enough participants. Thank you.").with_reason("full"));
            }
        };
    let token = app.secret.token(participant.session, &participant.id);
    Ok(json_reply(&json!({ "token": token, "state": session_state(&app.study, &participant) })))
}

fn is_parameter(name: &str, value: &str) -> bool {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.:@".contains(&byte);
    let starts_alphanumeric = value.bytes().next().is_none_or(|byte| byte.is_ascii_alphanumeric());
    PARAMETERS.contains(&name)
        && value.len() <= MAX_PARAMETER_BYTES
        && starts_alphanumeric
        && value.bytes().all(is_plain)
}

/// `GET /api/state`
pub async fn state(
    State(app): Shared,
    AuthenticatedSession { session, id }: AuthenticatedSession,
) -> Result<HttpResponse, ApiError> {
    let found = app.store.write(move |db| participants::find(db, &id)).await?;
    match found.filter(|participant| participant.session == session) {
        Some(participant) if participant.status == Status::Replaced => Err(gone()),
        Some(participant) => Ok(json_reply(&session_state(&app.study, &participant))),
        None => Err(unknown()),
    }
}

/// `POST /api/start`
pub async fn start(
    State(app): Shared,
    AuthenticatedSession { session, id }: AuthenticatedSession,
    JsonBody(start): JsonBody<TrialStart>,
) -> Result<HttpResponse, ApiError> {
    if !is_attempt(&start.load) {
        return Err(ApiError::bad_request("The field load must be 32 hexadecimal digits."));
    }
    let known = app.store.write(move |db| answers::record_start(db, &id, session, &start)).await?;
    if known { Ok(json_reply(&json!({ "known": true }))) } else { Err(unknown()) }
}

/// `POST /api/answer`
pub async fn answer(
    State(app): Shared,
    AuthenticatedSession { session, id }: AuthenticatedSession,
    JsonBody(answer): JsonBody<SubmittedAnswer>,
) -> Result<HttpResponse, ApiError> {
    let trials = app.study.trials(session);
    let out_of_turn = || ApiError::conflict("This trial has not been presented yet.");
    let trial = trials.get(answer.position as usize).ok_or_else(out_of_turn)?;
    check(&answer, trial, app.study.task(trial))?;
    let terms = TrialTerms {
        session,
        min_ms: app.study.min_ms(trial),
        is_last: answer.position as usize + 1 == trials.len(),
        fails_check: fails_check(&answer.response, trial),
    };
    let clock = app.clock;
    match app.store.write(move |db| record(db, &id, &answer, terms, clock.now_ms())).await? {
        RecordOutcome::Stored(participant) => {
            Ok(json_reply(&Acknowledged { feedback: feedback(trial), state: session_state(&app.study, &participant) }))
        }
        RecordOutcome::Unknown => Err(unknown()),
        RecordOutcome::Replaced => Err(gone()),
        RecordOutcome::Differs => Err(ApiError::conflict("A different answer to this trial is already stored.")),
        RecordOutcome::OutOfOrder => Err(out_of_turn()),
        RecordOutcome::TooEarly(left_ms) => {
            let sentence = "The films cannot have been played to the end yet.";
            Err(ApiError::new(StatusCode::TOO_EARLY, sentence).retry_after(left_ms / 1000 + 1))
        }
    }
}

#[derive(Serialize)]
struct Acknowledged<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    feedback: Option<&'a Response>,
    state: SessionState<'a>,
}

/// `POST /api/withdraw`
pub async fn withdraw(
    State(app): Shared,
    AuthenticatedSession { id, .. }: AuthenticatedSession,
) -> Result<HttpResponse, ApiError> {
    app.limits.forget(&id);
    let known = app.store.erase(move |db| participants::withdraw(db, &id)).await?;
    if known { Ok(json_reply(&json!({ "withdrawn": true }))) } else { Err(unknown()) }
}

/// `GET /api/operator`
pub async fn operator(State(app): Shared, headers: HeaderMap) -> Result<HttpResponse, ApiError> {
    if !app.secret.is_operator(bearer_token(&headers)?) {
        return Err(unauthorized());
    }
    let read = |db: &_| Ok((participants::all(db)?, participants::n_withdrawn(db)?, answers::stalls(db)?));
    let (all, withdrawn, stalls) = app.store.write(read).await?;
    let now_ms = app.clock.now_ms();
    let participant_row = |participant: &Participant| {
        // A completed session still shows its completion code.
        let is_open = participant.status != Status::Replaced;
        json!({
            "session": participant.session + 1,
            "status": participant.status,
            "position": participant.position,
            "n_trials": app.study.trials(participant.session).len(),
            "idle_secs": (now_ms - participant.given_ms).max(0) / 1000,
            // For participants who can no longer use the browser in which they started.
            "token": is_open.then(|| app.secret.token(participant.session, &participant.id)),
        })
    };
    Ok(json_reply(&json!({
        "title": app.study.title,
        "quota": app.study.quota.count(&all, withdrawn, now_ms),
        "answers": all.iter().map(|participant| participant.position).sum::<u32>(),
        "stalls": stalls,
        "participants": all.iter().map(participant_row).collect::<Vec<_>>(),
    })))
}

/// `GET /films/{16 hexadecimal digits}.mp4`, in full or as one byte range.
pub async fn film(State(app): Shared, Path(name): Path<String>, request: Request) -> HttpResponse {
    let Some(film) = name.strip_suffix(".mp4").and_then(|name| app.study.film(name)) else {
        return not_found().await.into_response();
    };
    let mut reply = serve_file(&film.path, request).await;
    if !reply.status().is_client_error() {
        let forever = HeaderValue::from_static("public, max-age=31536000, immutable");
        reply.headers_mut().insert(header::CACHE_CONTROL, forever);
    }
    reply
}
