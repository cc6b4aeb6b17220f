//! Files of the page by path below the token, with their content types.

use orator_web::axum::http::header;
use orator_web::axum::response::{IntoResponse, Response as HttpResponse};

const SCRIPT: &str = "text/javascript; charset=utf-8";

/// Path, content type and content of every file.
pub const ASSETS: [(&str, &str, &str); 1] = [("/", "text/html; charset=utf-8", "")];

/// Reply with the file at `path`, revalidated each time it is opened.
pub fn asset(path: &str) -> HttpResponse {
    let (_, content_type, text) = ASSETS.iter().find(|(known, ..)| *known == path).unwrap_or(&ASSETS[0]);
    ([(header::CONTENT_TYPE, *content_type), (header::CACHE_CONTROL, "no-cache")], *text).into_response()
}
