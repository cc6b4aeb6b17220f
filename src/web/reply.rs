//! Requests and replies: JSON bodies, bearer tokens, errors as a sentence with a status, the headers of every reply.

use axum::body::Bytes;
use axum::extract::{FromRequest, Request};
use axum::http::header::{self, HeaderName};
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response as HttpResponse};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::json;

/// Security headers of every reply: no embedding in other pages.
pub(crate) const HEADERS: [(HeaderName, &str); 5] = [
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

#[derive(Clone, Debug, PartialEq)]
pub struct ApiError {
    pub status: StatusCode,
    sentence: String,
    /// Key by which the page finds its own text.
    reason: Option<&'static str>,
    /// Seconds after which the request may succeed.
    retry_secs: Option<i64>,
}

impl ApiError {
    pub fn new(status: StatusCode, sentence: impl Into<String>) -> Self {
        Self { status, sentence: sentence.into(), reason: None, retry_secs: None }
    }

    pub fn bad_request(sentence: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, sentence)
    }

    pub fn conflict(sentence: impl Into<String>) -> Self {
        Self::new(StatusCode::CONFLICT, sentence)
    }

    /// Sets the reason, by which the page shows its text `REASON.text`.
    #[must_use]
    pub fn with_reason(self, reason: &'static str) -> Self {
        Self { reason: Some(reason), ..self }
    }

    /// Sets the header `Retry-After`, seconds.
    #[must_use]
    pub fn retry_after(self, secs: i64) -> Self {
        Self { retry_secs: Some(secs), ..self }
    }

    pub fn too_many_requests() -> Self {
        Self::new(StatusCode::TOO_MANY_REQUESTS, "Too many requests; wait a moment.").retry_after(2)
    }
}

impl IntoResponse for ApiError {
    fn into_response(self) -> HttpResponse {
        let mut body = json!({ "error": self.sentence });
        if let Some(reason) = self.reason {
            body["reason"] = json!(reason);
        }
        let mut reply = with_status(self.status, &body);
        if let Some(secs) = self.retry_secs {
            reply.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(secs.max(0)));
        }
        if self.status == StatusCode::UNAUTHORIZED {
            reply.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        reply
    }
}

/// JSON reply that must not be cached.
pub fn json_reply(value: &impl Serialize) -> HttpResponse {
    with_status(StatusCode::OK, value)
}

fn with_status(status: StatusCode, value: &impl Serialize) -> HttpResponse {
    let Ok(text) = serde_json::to_vec(value) else { return StatusCode::INTERNAL_SERVER_ERROR.into_response() };
    (status, [(header::CONTENT_TYPE, "application/json"), (header::CACHE_CONTROL, "no-store")], text).into_response()
}

/// Static text of a page, revalidated each time it is opened.
pub fn text_reply(content_type: &'static str, text: &'static str) -> HttpResponse {
    ([(header::CONTENT_TYPE, content_type), (header::CACHE_CONTROL, "no-cache")], text).into_response()
}

/// Reply for an address that does not exist.
pub async fn not_found() -> ApiError {
    ApiError::new(StatusCode::NOT_FOUND, "This address does not exist.")
}

pub async fn method_not_allowed() -> ApiError {
    ApiError::new(StatusCode::METHOD_NOT_ALLOWED, "This address does not accept the method of the request.")
}

/// JSON body of a request. Requiring the content type `application/json` rejects HTML forms of other sites.
pub struct JsonBody<T>(pub T);

impl<T: DeserializeOwned, S: Send + Sync> FromRequest<S> for JsonBody<T> {
    type Rejection = ApiError;

    async fn from_request(request: Request, state: &S) -> Result<Self, ApiError> {
        let content_type = header_text(request.headers(), header::CONTENT_TYPE).unwrap_or_default();
        let kind = content_type.split(';').next().unwrap_or_default().trim();
        if !kind.eq_ignore_ascii_case("application/json") {
            return Err(ApiError::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, "The body must be application/json."));
        }
        let bytes = Bytes::from_request(request, state).await;
        let bytes = bytes.map_err(|error| ApiError::new(error.status(), "The body is too large or incomplete."))?;
        let value = serde_json::from_slice(&bytes);
        value.map(Self).map_err(|_| ApiError::bad_request("The body is not valid JSON for this address."))
    }
}

pub fn bearer_token(headers: &HeaderMap) -> Result<&str, ApiError> {
    let token = header_text(headers, header::AUTHORIZATION).and_then(|text| text.strip_prefix("Bearer "));
    token.ok_or_else(unauthorized)
}

/// Reply for a missing or invalid token.
pub fn unauthorized() -> ApiError {
    ApiError::new(StatusCode::UNAUTHORIZED, "A valid token is required.")
}

/// Header as text; `None` if it is missing or contains bytes other than visible ASCII.
pub fn header_text(headers: &HeaderMap, name: header::HeaderName) -> Option<&str> {
    headers.get(name)?.to_str().ok()
}
