//! Spans of a long video that several workers can process independently. They begin at fixed intervals, or at a cut
//! shortly after, and only where decoding from that point yields the same pictures.

use super::reading::{PictureReading, checksum, thumbnail};
use anyhow::Result;
use orator_base::types::image::PixelArea;
use orator_base::types::time::FrameRate;
use orator_media::ffmpeg::frames::FrameReader;

const MARK_INTERVAL_SECS: f64 = 120.0;
/// A cut within this many seconds after a mark replaces it.
const MAX_CUT_DELAY_SECS: f64 = 20.0;
/// Least duration of the last span in seconds.
const MIN_LAST_SECS: f64 = 60.0;
/// Number of frames to compare after a seek.
const N_COMPARED: usize = 15;

/// Number of spans of a video of `secs` seconds, if no mark is rejected.
pub fn count(secs: f64) -> usize {
    1 + ((secs - MIN_LAST_SECS).max(0.0) / MARK_INTERVAL_SECS) as usize
}

/// Sets `timeline.span` where spans begin. `open` opens a reader of the pictures, of which `area` counts.
pub fn mark(
    read: &mut PictureReading,
    open: impl FnOnce() -> Result<FrameReader>,
    area: Option<PixelArea>,
    rate: FrameRate,
) -> Result<()> {
    let starts = candidates(&read.timeline.restart, rate);
    if starts.is_empty() {
        return Ok(());
    }
    let mut reader = open()?;
    for start in starts {
        // If the container cannot seek there, the previous span continues.
        let is_equal = seek_is_exact(read, &mut reader, area, start).unwrap_or(false);
        read.timeline.span[start] = is_equal;
    }
    Ok(())
}

/// Frames at which spans may begin.
pub fn candidates(restarts: &[bool], rate: FrameRate) -> Vec<usize> {
    let frames = |secs: f64| (secs * rate.per_sec()).round() as usize;
    let marks = (1..).map(|number| frames(f64::from(number) * MARK_INTERVAL_SECS));
    let marks = marks.take_while(|mark| mark + frames(MIN_LAST_SECS) <= restarts.len());
    let to_cut = |mark: usize| {
        let following = &restarts[mark..restarts.len().min(mark + frames(MAX_CUT_DELAY_SECS))];
        mark + following.iter().position(|restart| *restart).unwrap_or(0)
    };
    marks.map(to_cut).collect()
}

/// Whether decoding from frame `start` yields the same frames as decoding from the first frame.
fn seek_is_exact(
    read: &PictureReading,
    reader: &mut FrameReader,
    area: Option<PixelArea>,
    start: usize,
) -> Result<bool> {
    let timeline = &read.timeline;
    reader.seek(start, timeline.source_secs[start])?;
    for idx in start..(start + N_COMPARED).min(timeline.n_frames()) {
        let Some(time) = reader.advance()? else { return Ok(false) };
        let is_equal = time.frame_idx == idx
            && time.source_secs.total_cmp(&timeline.source_secs[idx]).is_eq()
            && checksum(&thumbnail(reader, area)?) == read.checksums[idx];
        if !is_equal {
            return Ok(false);
        }
    }
    Ok(true)
}
