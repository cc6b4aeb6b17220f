//! The addresses of the server.

use super::app::App;
use super::reply::{guard, not_found, text_reply, wrong_method};
use super::{api, operator};
use crate::pages::assets::ASSETS;
use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::middleware::from_fn;
use axum::routing::{get, post};
use std::sync::Arc;

/// Bytes of a body at most.
const MOST_BODY: usize = 16 * 1024;

/// The addresses of a study's server.
pub fn router(app: App) -> Router {
    let mut router = Router::new()
        .route("/api/study", get(api::study))
        .route("/api/begin", post(api::begin))
        .route("/api/state", get(api::state))
        .route("/api/answer", post(api::answer))
        .route("/api/withdraw", post(api::withdraw))
        .route("/api/operator", get(operator::progress))
        .route("/films/{name}", get(api::film));
    for (path, content_type, text) in ASSETS {
        router = router.route(path, get(async move || text_reply(content_type, text)));
    }
    router
        .fallback(not_found)
        .method_not_allowed_fallback(wrong_method)
        .layer(DefaultBodyLimit::max(MOST_BODY))
        .layer(from_fn(guard))
        .with_state(Arc::new(app))
}
