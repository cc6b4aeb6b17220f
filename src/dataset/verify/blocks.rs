//! Check of a video with samples in several splits: the dataset must be divided by time, each sample must be inside a
//! block of its split, and samples of different splits must be at least the stated gap apart.

use crate::config::choices::SplitUnit;
use crate::info::DatasetInfo;
use crate::write::entry::VideoEntry;
use anyhow::{Context, Result, ensure};
use orator_base::types::split::Split;
use std::ops::Range;

/// Checks the splits of a video.
///
/// # Errors
/// Samples in several splits of a dataset that is not divided by time, a sample outside the blocks of its split,
/// samples of different splits that are too close.
pub fn check_blocks(entry: &VideoEntry, info: &DatasetInfo) -> Result<()> {
    if entry.split.is_some() || entry.samples.is_empty() {
        return Ok(());
    }
    let rule = info.split_rule.as_ref().filter(|rule| rule.unit == SplitUnit::Time);
    let rule = rule.context("it has samples in several splits, but the dataset is not divided by time")?;
    let mut samples: Vec<(Range<usize>, Split, &str)> = Vec::new();
    for sample in &entry.samples {
        let first = sample.key.rsplit('-').next().and_then(|first| first.parse::<usize>().ok());
        let first = first.with_context(|| format!("the key {} does not end in its first frame", sample.key))?;
        samples.push((first..first + sample.n_frames, sample.split, &sample.key));
    }
    samples.sort_by_key(|(frames, ..)| frames.start);
    // Block boundaries are in seconds, so they may be off a frame boundary by up to half a frame.
    let half_frame_secs = info.fps.secs(1) / 2.0;
    for (frames, split, key) in &samples {
        let (start, end) = (info.fps.secs(frames.start), info.fps.secs(frames.end));
        let is_inside = entry.blocks.iter().any(|block| {
            block.split == Some(*split)
                && block.start_secs - half_frame_secs <= start
                && end <= block.end_secs + half_frame_secs
        });
        ensure!(is_inside, "the sample {key} is not in a block of the {} split", split.name());
    }
    for (n, (frames, split, key)) in samples.iter().enumerate() {
        let Some((next, other, other_key)) = samples[n + 1..].iter().find(|(_, other, _)| other != split) else {
            continue;
        };
        let gap_secs = info.fps.secs(next.start) - info.fps.secs(frames.end);
        ensure!(
            gap_secs >= rule.guard_secs - half_frame_secs,
            "{key} ({}) and {other_key} ({}) are {gap_secs:.2} s apart, expected at least {:.2} s between splits",
            split.name(),
            other.name(),
            rule.guard_secs
        );
    }
    Ok(())
}
