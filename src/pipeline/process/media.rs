//! What is asked of a video before any stage works on it: its length, and excerpts that are timed.

use super::message::MediaRequest;
use anyhow::Result;
use orator_media::ffmpeg::probe::probe;
use orator_media::ffmpeg::write::excerpt;

/// The length of a video in seconds, where a header says it; of an excerpt, what was copied.
///
/// # Errors
/// A video that cannot be read, an excerpt that cannot be copied.
pub fn answer(request: &MediaRequest) -> Result<Option<f64>> {
    match &request.excerpt {
        None => Ok(probe(&request.source)?.duration_secs),
        Some(wanted) => excerpt::copy(&request.source, &wanted.to, wanted.start_secs, wanted.secs).map(Some),
    }
}
