//! Replies: JSON, errors as a sentence with a status, and the headers that every reply carries.

use axum::extract::Request;
use axum::http::header::{self, HeaderName};
use axum::http::{HeaderValue, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response as HttpResponse};
use serde::Serialize;
use serde_json::json;
use std::time::Duration;

/// Time that a request may take until its reply begins, the reading of its body with it.
const REQUEST_TIME: Duration = Duration::from_secs(10);

/// Headers of every reply: nothing from elsewhere is loaded, nothing is shown within another page.
const HEADERS: [(HeaderName, &str); 7] = [
    (
        header::CONTENT_SECURITY_POLICY,
        "default-src 'none'; script-src 'self'; style-src 'self'; media-src 'self'; connect-src 'self'; \
         img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (
        HeaderName::from_static("permissions-policy"),
        "camera=(), microphone=(), geolocation=(), display-capture=(), usb=()",
    ),
];

/// Refusal of a request, in a sentence for who sent it.
#[derive(Clone, Debug, PartialEq)]
pub struct ApiError {
    pub status: StatusCode,
    sentence: String,
    /// Seconds after which the request may succeed.
    retry_secs: Option<i64>,
}

impl ApiError {
    pub fn new(status: StatusCode, sentence: impl Into<String>) -> Self {
        Self { status, sentence: sentence.into(), retry_secs: None }
    }

    pub fn bad(sentence: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, sentence)
    }

    pub fn conflict(sentence: impl Into<String>) -> Self {
        Self::new(StatusCode::CONFLICT, sentence)
    }

    /// May be tried again after so many seconds.
    #[must_use]
    pub fn retry_after(self, secs: i64) -> Self {
        Self { retry_secs: Some(secs), ..self }
    }

    pub fn too_often() -> Self {
        Self::new(StatusCode::TOO_MANY_REQUESTS, "Too many requests; wait a moment.").retry_after(2)
    }

    pub fn not_stored() -> Self {
        let sentence = "The server cannot store anything at the moment; try again.";
        Self::new(StatusCode::SERVICE_UNAVAILABLE, sentence).retry_after(5)
    }
}

impl IntoResponse for ApiError {
    fn into_response(self) -> HttpResponse {
        let mut reply = with_status(self.status, &json!({ "error": self.sentence }));
        if let Some(secs) = self.retry_secs {
            reply.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(secs.max(0)));
        }
        if self.status == StatusCode::UNAUTHORIZED {
            reply.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        reply
    }
}

/// Value as JSON that nobody keeps.
pub fn json_reply(value: &impl Serialize) -> HttpResponse {
    with_status(StatusCode::OK, value)
}

fn with_status(status: StatusCode, value: &impl Serialize) -> HttpResponse {
    let Ok(text) = serde_json::to_vec(value) else { return StatusCode::INTERNAL_SERVER_ERROR.into_response() };
    (status, [(header::CONTENT_TYPE, "application/json"), (header::CACHE_CONTROL, "no-store")], text).into_response()
}

/// Text of the page, looked up anew each time it is opened.
pub fn text_reply(content_type: &'static str, text: &'static str) -> HttpResponse {
    ([(header::CONTENT_TYPE, content_type), (header::CACHE_CONTROL, "no-cache")], text).into_response()
}

/// Reply to a path that is not served.
pub async fn not_found() -> ApiError {
    ApiError::new(StatusCode::NOT_FOUND, "There is nothing at this address.")
}

/// Reply to a method that a path does not have.
pub async fn wrong_method() -> ApiError {
    ApiError::new(StatusCode::METHOD_NOT_ALLOWED, "This address does not take that method.")
}

/// Ends what takes too long, and adds the headers of every reply.
pub async fn guard(request: Request, next: Next) -> HttpResponse {
    let late = || ApiError::new(StatusCode::REQUEST_TIMEOUT, "The request took too long.");
    let mut reply = match tokio::time::timeout(REQUEST_TIME, next.run(request)).await {
        Ok(reply) => reply,
        Err(_) => late().into_response(),
    };
    for (name, value) in HEADERS {
        reply.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    if !reply.headers().contains_key(header::CACHE_CONTROL) {
        reply.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    }
    reply
}
