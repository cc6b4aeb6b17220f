//! What the operator sees: how many take part, how far they are, and which places are left.

use super::app::{App, now_ms};
use super::body::{bearer, unauthorized};
use super::reply::{ApiError, json_reply};
use crate::store::answers;
use crate::store::participants::{self, Participant};
use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::Response as HttpResponse;
use serde_json::json;
use std::sync::Arc;

/// `GET /api/operator`
pub async fn progress(State(app): State<Arc<App>>, headers: HeaderMap) -> Result<HttpResponse, ApiError> {
    if !app.secret.is_operator(bearer(&headers)?) {
        return Err(unauthorized());
    }
    let read = |db: &_| Ok((participants::all(db)?, participants::n_withdrawn(db)?, answers::stalls(db)?));
    let (all, withdrawn, stalls) = app.store.write(read).await.map_err(|_| ApiError::not_stored())?;
    let now_ms = now_ms();
    let place = |participant: &Participant| {
        json!({
            "place": participant.session + 1,
            "status": participant.status,
            "position": participant.position,
            "n_trials": app.study.trials(participant.session).len(),
            "idle_secs": (now_ms - participant.given_ms).max(0) / 1000,
        })
    };
    Ok(json_reply(&json!({
        "title": app.study.title,
        "quota": app.study.quota.count(&all, withdrawn, now_ms),
        "answers": all.iter().map(|participant| participant.position).sum::<u32>(),
        "stalls": stalls,
        "participants": all.iter().map(place).collect::<Vec<_>>(),
    })))
}
