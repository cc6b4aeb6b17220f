//! Time 0 of a file: presentation time of its first picture that decodes, on the container's clock. Sound is placed
//! relative to it.

use super::decode::StreamDecoder;
use super::source;
use anyhow::Result;
use ffmpeg_next::{Packet, frame};
use std::path::Path;

/// Largest number of packets read in search of the first picture.
const MOST_PACKETS: usize = 100_000;

/// Second on the container's clock at which the first picture of `path` that decodes is shown; `None` without pictures.
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
    if has_edits && let Some(unmoved) = unmoved_ticks(path, stream_idx, position)? {
        let early_secs = unmoved.saturating_sub(ticks) as f64 * f64::from(tick);
        let longest_secs = first.packet().duration.max(1) as f64 * f64::from(tick);
        if early_secs > 0.0 && early_secs <= longest_secs {
            ticks = unmoved;
        }
    }
    Ok(Some(ticks as f64 * f64::from(tick)))
}

/// Presentation time of the picture at byte `position` without edit lists. Where an edit list begins between two
/// pictures, ffmpeg's default moves the first whole picture (and all after it) to the beginning of the edit, while the
/// sound stays.
fn unmoved_ticks(path: &Path, stream_idx: usize, position: i64) -> Result<Option<i64>> {
    let mut input = source::open_with(path, &[("advanced_editlist", "0")])?;
    let mut packet = Packet::empty();
    for _ in 0..MOST_PACKETS {
        if packet.read(&mut input).is_err() {
            break;
        }
        if packet.stream() == stream_idx && packet.position() as i64 == position {
            return Ok(packet.pts());
        }
    }
    Ok(None)
}
