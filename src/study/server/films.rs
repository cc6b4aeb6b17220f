//! Films: the plan's alone, read piece by piece, in ranges of bytes where a player asks for them.

use super::body::header_text;
use super::range::{FilmPart, part};
use super::reply::{ApiError, not_found};
use super::served::ServedFilm;
use axum::body::{Body, Bytes};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response as HttpResponse};
use hyper::body::{Body as HttpBody, Frame, SizeHint};
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::pin::Pin;
use std::task::{Context, Poll};

/// Bytes that are read at once.
const PIECE: u64 = 256 * 1024;

/// Reply with the film, or the part of it that the header `Range` asks for.
pub async fn reply(film: &ServedFilm, headers: &HeaderMap) -> HttpResponse {
    let ranges = [(header::ACCEPT_RANGES, "bytes".to_owned())];
    let (first, last, status) = match part(header_text(headers, header::RANGE), film.size) {
        FilmPart::Whole => (0, film.size.saturating_sub(1), StatusCode::OK),
        FilmPart::Bytes { first, last } => (first, last, StatusCode::PARTIAL_CONTENT),
        FilmPart::Unsatisfiable => {
            let range = [(header::CONTENT_RANGE, format!("bytes */{}", film.size))];
            let refusal = ApiError::new(StatusCode::RANGE_NOT_SATISFIABLE, "The film is shorter.");
            return (ranges, range, refusal).into_response();
        }
    };
    let end = film.size.min(last + 1);
    let path = film.path.clone();
    let Ok(Ok(file)) = tokio::task::spawn_blocking(move || File::open(path)).await else {
        return not_found().await.into_response();
    };
    let body = Body::new(FilmReader { file, at: first, end });
    let headers = [
        (header::CONTENT_TYPE, "video/mp4".to_owned()),
        (header::CONTENT_LENGTH, (end - first).to_string()),
        (header::CACHE_CONTROL, "public, max-age=31536000, immutable".to_owned()),
    ];
    let mut reply = (status, ranges, headers, body).into_response();
    let range = HeaderValue::from_str(&format!("bytes {first}-{last}/{}", film.size));
    if let (StatusCode::PARTIAL_CONTENT, Ok(range)) = (status, range) {
        reply.headers_mut().insert(header::CONTENT_RANGE, range);
    }
    reply
}

/// Bytes `at..end` of a file, as a player takes them.
struct FilmReader {
    file: File,
    at: u64,
    end: u64,
}

impl HttpBody for FilmReader {
    type Data = Bytes;
    type Error = io::Error;

    fn poll_frame(mut self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<Option<io::Result<Frame<Bytes>>>> {
        let n = (self.end - self.at).min(PIECE);
        if n == 0 {
            return Poll::Ready(None);
        }
        let mut bytes = vec![0; n as usize];
        let read = tokio::task::block_in_place(|| self.file.read_exact_at(&mut bytes, self.at));
        self.at += n;
        Poll::Ready(Some(read.map(|()| Frame::data(bytes.into()))))
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.end - self.at)
    }
}
