//! The frames of a span of a video, in the order of its timeline.

use anyhow::{Context, Result, ensure};
use orator_base::stage::Unit;
use orator_base::types::image::Image;
use orator_base::types::time::FrameRate;
use orator_formats::media_json::MediaInfo;
use orator_formats::timeline_npz::Timeline;
use orator_media::ffmpeg::frames::{FrameReader, FrameTime};
use std::ops::Range;
use std::path::Path;
use std::sync::mpsc;

/// Capacity of the queue of decoded frames.
const QUEUE_LEN: usize = 3;

/// A span of an extracted video.
pub struct VideoFrames<'a> {
    pub unit: &'a Unit,
    pub timeline: &'a Timeline,
    pub media: &'a MediaInfo,
    pub fps: FrameRate,
    /// Frame range of the span, one of the timeline's.
    pub span: Range<usize>,
}

impl VideoFrames<'_> {
    /// Calls `work` with each frame's time, whether it begins a shot (true for the first frame of the span), and its
    /// picture unless it repeats the previous one. Returns the width and height of the full picture in px.
    ///
    /// # Errors
    /// A video that cannot be read, or whose frames do not match the timeline.
    pub fn each(&self, mut work: impl FnMut(FrameTime, bool, Option<Image>) -> Result<()>) -> Result<[u32; 2]> {
        let (source, n_expected) = (&self.unit.source, self.timeline.n_frames());
        let mut reader = FrameReader::open(source, self.fps)?.with_options(self.media.pictures);
        let [width, height] = reader.image_size();
        if self.span.start > 0 {
            reader.seek(self.span.start, self.timeline.source_secs[self.span.start])?;
        }
        if self.span.end < n_expected {
            reader = reader.until(self.span.end);
        }
        let begins_shot = |time: FrameTime| {
            let restart = self.timeline.restart.get(time.frame_idx).copied();
            let restart = restart.with_context(|| frame_count_mismatch(source, time.frame_idx + 1, n_expected))?;
            Ok::<_, anyhow::Error>(restart || time.frame_idx == self.span.start)
        };
        let pick = |reader: &mut FrameReader, time: FrameTime| {
            let is_new = begins_shot(time)? || !time.repeated;
            let full_picture = is_new.then(|| reader.picture(None)).transpose()?;
            Ok(match (full_picture, self.media.active_area) {
                (Some(full_picture), Some(area)) => Some(full_picture.cropped(area)),
                (full_picture, _) => full_picture,
            })
        };
        let mut end = self.span.start;
        for_each_ahead(reader, pick, |time, picture| {
            end = time.frame_idx + 1;
            // After a seek, the times must equal those of a sequential read.
            let known = self.timeline.source_secs.get(time.frame_idx);
            ensure!(
                self.span.start == 0 || known.is_some_and(|known| known.total_cmp(&time.source_secs).is_eq()),
                "{}, frame {}: its time differs from the timeline: run the stage extract again",
                source.display(),
                time.frame_idx
            );
            work(time, begins_shot(time)?, picture)
        })?;
        ensure!(end == self.span.end, frame_count_mismatch(source, end, n_expected));
        Ok([u32::try_from(width)?, u32::try_from(height)?])
    }
}

fn frame_count_mismatch(video: &Path, found: usize, expected: usize) -> String {
    format!("{} has {found} decoded frames, its timeline {expected}: run the stage extract again", video.display())
}

/// Decodes ahead: reads all frames of `reader` in a thread, where `pick` selects what is needed of each, and passes
/// the selections to `work` in order. At most five selections are in memory.
fn for_each_ahead<T: Send>(
    mut reader: FrameReader,
    mut pick: impl FnMut(&mut FrameReader, FrameTime) -> Result<T> + Send,
    mut work: impl FnMut(FrameTime, T) -> Result<()>,
) -> Result<()> {
    std::thread::scope(|scope| {
        let (sender, picks) = mpsc::sync_channel(QUEUE_LEN);
        scope.spawn(move || {
            loop {
                let next = reader.advance().and_then(|time| {
                    let Some(time) = time else { return Ok(None) };
                    Ok(Some((time, pick(&mut reader, time)?)))
                });
                let Some(next) = next.transpose() else { break };
                let has_failed = next.is_err();
                // The receiver is dropped when `work` fails.
                if sender.send(next).is_err() || has_failed {
                    break;
                }
            }
        });
        picks.into_iter().try_for_each(|next| next.and_then(|(time, picked)| work(time, picked)))
    })
}
