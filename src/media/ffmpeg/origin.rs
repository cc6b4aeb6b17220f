//! Time 0 of a file: the presentation time of its first image that decodes, on the container's clock. Audio and the
//! times of transcripts are aligned to it.

use super::decode::StreamDecoder;
use super::source;
use anyhow::Result;
use ffmpeg_next::{Packet, ffi, frame};
use std::path::Path;

/// Maximum number of packets read in search of the first image.
const MAX_PACKETS: usize = 100_000;

/// Presentation time of time 0 of `path`, seconds from the start of the file as players count it, to 0.1 ms: later than
/// 0 if the first image is later than the first sound. 0 without images.
pub fn start_secs(path: &Path) -> Result<f64> {
    let Some(first_secs) = first_picture_secs(path)? else { return Ok(0.0) };
    let input = source::open(path)?;
    // SAFETY: the context is live and only read here.
    let start = unsafe { (*input.as_ptr()).start_time };
    if start == ffi::AV_NOPTS_VALUE {
        return Ok(0.0);
    }
    let secs = first_secs - start as f64 / f64::from(ffi::AV_TIME_BASE);
    Ok((secs * 1e4).round().max(0.0) / 1e4)
}

/// Presentation time of the first decodable image of `path`, seconds on the container's clock; `None` without images.
pub(crate) fn first_picture_secs(path: &Path) -> Result<Option<f64>> {
    let input = source::open(path)?;
    let has_edits = input.format().name().contains("mp4");
    let Some(stream_idx) = source::video_stream(&input).map(|stream| stream.index()) else { return Ok(None) };
    let mut decode = StreamDecoder::new(path, input, stream_idx, 1)?;
    let mut first = frame::Video::empty();
    if !decode.next(&mut first)? {
        return Ok(None);
    }
    let (tick, position) = (decode.time_base(), first.packet().position);
    let mut ticks = first.timestamp().unwrap_or(0);
    drop(decode);
    if has_edits && let Some(unedited) = unedited_ticks(path, stream_idx, position)? {
        let early_secs = unedited.saturating_sub(ticks) as f64 * f64::from(tick);
        let longest_secs = first.packet().duration.max(1) as f64 * f64::from(tick);
        if early_secs > 0.0 && early_secs <= longest_secs {
            ticks = unedited;
        }
    }
    Ok(Some(ticks as f64 * f64::from(tick)))
}

/// Presentation time of the image at byte `position` without edit lists. If an edit list begins between two images,
/// ffmpeg by default moves the first complete image and all later ones to the start of the edit, but not the audio.
fn unedited_ticks(path: &Path, stream_idx: usize, position: i64) -> Result<Option<i64>> {
    let mut input = source::open_with(path, &[("advanced_editlist", "0")])?;
    let mut packet = Packet::empty();
    for _ in 0..MAX_PACKETS {
        if packet.read(&mut input).is_err() {
            break;
        }
        if packet.stream() == stream_idx && packet.position() as i64 == position {
            return Ok(packet.pts());
        }
    }
    Ok(None)
}
