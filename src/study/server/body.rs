//! What requests say: their JSON, and the token they carry.

use super::reply::ApiError;
use axum::body::Bytes;
use axum::extract::{FromRequest, Request};
use axum::http::{HeaderMap, StatusCode, header};
use serde::de::DeserializeOwned;

/// Body of a request, JSON of a known form. Its content type must say so, which a form of another site cannot.
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
        let bytes = bytes.map_err(|error| ApiError::new(error.status(), "The body is too large, or broke off."))?;
        let value = serde_json::from_slice(&bytes);
        value.map(Self).map_err(|_| ApiError::bad("The body is not the JSON that this address takes."))
    }
}

/// Token of the header `Authorization: Bearer TOKEN`.
///
/// # Errors
/// No such header.
pub fn bearer(headers: &HeaderMap) -> Result<&str, ApiError> {
    let token = header_text(headers, header::AUTHORIZATION).and_then(|text| text.strip_prefix("Bearer "));
    token.ok_or_else(unauthorized)
}

/// Refusal of a token.
pub fn unauthorized() -> ApiError {
    ApiError::new(StatusCode::UNAUTHORIZED, "A valid token is needed.")
}

/// Header as text; `None`: not there, or not of printable ASCII letters.
pub fn header_text(headers: &HeaderMap, name: header::HeaderName) -> Option<&str> {
    headers.get(name)?.to_str().ok()
}
