//! Files as replies, in full or as one byte range, and random names.

use crate::reply::{ApiError, header_text, not_found};
use anyhow::{Context, Result};
use axum::body::Body;
use axum::body::HttpBody as _;
use axum::extract::Request;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response as HttpResponse};
use std::fs::File;
use std::future::poll_fn;
use std::io::{Read, Write as _};
use std::path::Path;
use std::pin::Pin;
use tower_http::services::ServeFile;

/// Maximum size of an uploaded file, bytes.
const MAX_BODY_BYTES: u64 = 200 << 20;

/// The file at `path`, in full or as one byte range; status 404 if it cannot be read.
pub async fn serve_file(path: &Path, mut request: Request) -> HttpResponse {
    if !header_text(request.headers(), header::RANGE).is_some_and(is_one_range) {
        request.headers_mut().remove(header::RANGE);
    }
    match ServeFile::new(path).try_call(request).await {
        Ok(reply) => reply.map(Body::new),
        Err(_) => not_found().await.into_response(),
    }
}

/// Writes the body of a request to the new file `path`, piece by piece.
///
/// # Errors
/// Status 413 above 200 MB, 400 for an empty or incomplete body, 500 if the file cannot be written.
pub async fn save_body(request: Request, path: &Path) -> Result<(), ApiError> {
    let too_large = || ApiError::new(StatusCode::PAYLOAD_TOO_LARGE, "The file is larger than 200 MB.");
    let incomplete = |_| ApiError::bad_request("The file is incomplete.");
    let not_written =
        |error: std::io::Error| ApiError::new(StatusCode::INTERNAL_SERVER_ERROR, format!("cannot store it: {error}"));
    let mut file = File::create_new(path).map_err(not_written)?;
    let (mut body, mut n_bytes) = (request.into_body(), 0);
    while let Some(frame) = poll_fn(|cx| Pin::new(&mut body).poll_frame(cx)).await {
        let Ok(piece) = frame.map_err(incomplete)?.into_data() else { continue };
        n_bytes += piece.len() as u64;
        if n_bytes > MAX_BODY_BYTES {
            return Err(too_large());
        }
        tokio::task::block_in_place(|| file.write_all(&piece)).map_err(not_written)?;
    }
    if n_bytes == 0 { Err(ApiError::bad_request("The file is empty.")) } else { Ok(()) }
}

/// Cryptographically secure random bytes.
///
/// # Errors
/// The random source of the system cannot be read.
pub fn random<const N: usize>() -> Result<[u8; N]> {
    let mut bytes = [0; N];
    let read = File::open("/dev/urandom").and_then(|mut source| source.read_exact(&mut bytes));
    read.context("cannot read /dev/urandom")?;
    Ok(bytes)
}

/// Bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Whether a `Range` header requests a single byte range such as `bytes=2-5`; others may be ignored (RFC 9110, 14.2).
fn is_one_range(range: &str) -> bool {
    let ends = range.strip_prefix("bytes=").and_then(|ends| ends.split_once('-'));
    let is_number = |digits: &str| digits.bytes().all(|byte| byte.is_ascii_digit());
    ends.is_some_and(|(first, last)| {
        let is_ordered = || first.parse::<u64>().ok() <= last.parse::<u64>().ok() || last.is_empty();
        is_number(first) && is_number(last) && !(first.is_empty() && last.is_empty()) && is_ordered()
    })
}

#[cfg(test)]
mod tests {
    use super::is_one_range;

    #[test]
    fn single_ranges_are_recognised() {
        let one = ["bytes=0-0", "bytes=2-5", "bytes=2-", "bytes=-3", "bytes=-0", "bytes=10-"];
        assert!(one.into_iter().all(is_one_range));
        let others = ["5-2", "-", "", "0-1,3-4", "a-b", "+1-2", " 1-2"].map(|ends| format!("bytes={ends}"));
        assert!(!others.iter().map(String::as_str).chain(["Bytes=1-2", ""]).any(is_one_range));
    }
}
