//! Spans of a long video that can be worked on apart, by several workers: they begin at fixed marks of the video's own
//! time, at a cut where one comes soon, and only where reading that begins there gives the same pictures.

use super::reading::{PictureReading, checksum, thumbnail};
use anyhow::Result;
use orator_base::types::image::PixelArea;
use orator_base::types::time::FrameRate;
use orator_media::ffmpeg::frames::FrameReader;

/// A mark stands at every multiple of so many seconds.
const APART_SECS: f64 = 120.0;
/// A cut that comes no later after its mark takes the mark's place.
const CUT_WITHIN_SECS: f64 = 20.0;
/// Least length of the last span.
const LEAST_LAST_SECS: f64 = 60.0;
/// Frames that are compared where reading begins.
const COMPARED: usize = 15;

/// The number of spans of a video of that length, where none of its marks is passed over.
pub fn count(secs: f64) -> usize {
    1 + ((secs - LEAST_LAST_SECS).max(0.0) / APART_SECS) as usize
}

/// Marks in the timeline where spans begin. The reader that `open` gives reads the pictures, of which `area` counts.
///
/// # Errors
/// Those of `open`.
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
        // Where the container cannot go the span before goes on.
        let is_same = is_read_alike(read, &mut reader, area, start).unwrap_or(false);
        read.timeline.span[start] = is_same;
    }
    Ok(())
}

/// Frames at which spans would begin.
fn candidates(restarts: &[bool], rate: FrameRate) -> Vec<usize> {
    let frames = |secs: f64| (secs * rate.per_sec()).round() as usize;
    let marks = (1..).map(|number| frames(f64::from(number) * APART_SECS));
    let marks = marks.take_while(|mark| mark + frames(LEAST_LAST_SECS) <= restarts.len());
    let moved = |mark: usize| {
        let soon = &restarts[mark..restarts.len().min(mark + frames(CUT_WITHIN_SECS))];
        mark + soon.iter().position(|restart| *restart).unwrap_or(0)
    };
    marks.map(moved).collect()
}

/// Whether reading that begins at the frame `start` gives the frames that reading from the first one gave.
fn is_read_alike(
    read: &PictureReading,
    reader: &mut FrameReader,
    area: Option<PixelArea>,
    start: usize,
) -> Result<bool> {
    let timeline = &read.timeline;
    reader.seek(start, timeline.source_secs[start])?;
    for idx in start..(start + COMPARED).min(timeline.n_frames()) {
        let Some(time) = reader.advance()? else { return Ok(false) };
        let is_same = time.frame_idx == idx
            && time.source_secs.total_cmp(&timeline.source_secs[idx]).is_eq()
            && checksum(&thumbnail(reader, area)?) == read.checksums[idx];
        if !is_same {
            return Ok(false);
        }
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_begin_at_marks_or_at_a_cut_soon_after_and_the_last_is_no_stub() {
        let rate = FrameRate::new(10, 1);
        let mut restarts = vec![false; 4199];
        assert_eq!(candidates(&restarts, rate), [1200, 2400]);
        restarts.push(false);
        assert_eq!(candidates(&restarts, rate), [1200, 2400, 3600]);
        for cut in [0, 1100, 1399, 2600, 3600] {
            restarts[cut] = true;
        }
        assert_eq!(candidates(&restarts, rate), [1399, 2400, 3600]);
        assert_eq!(candidates(&restarts[..1799], rate), [0; 0]);
        assert_eq!([179.9, 180.0, 300.0, 1020.0].map(count), [1, 2, 3, 9]);
    }
}
