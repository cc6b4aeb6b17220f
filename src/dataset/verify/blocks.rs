//! Splits of a video with samples in several: only a division by time allows that, each sample lies in a block of its
//! split, and samples of different splits are as far apart as the dataset states.

use crate::config::choices::SplitUnit;
use crate::info::DatasetInfo;
use crate::write::part::VideoEntry;
use anyhow::{Context, Result, ensure};
use orator_base::types::split::Split;
use std::ops::Range;

/// Checks the splits of a video.
///
/// # Errors
/// A video in several splits where videos are whole, a sample outside its block or too near to another split.
pub fn check_blocks(part: &VideoEntry, info: &DatasetInfo) -> Result<()> {
    if part.split.is_some() || part.samples.is_empty() {
        return Ok(());
    }
    let rule = info.split_rule.as_ref().filter(|rule| rule.unit == SplitUnit::Time);
    let rule = rule.context("it has samples in several splits, though the dataset is not divided by time")?;
    let mut samples: Vec<(Range<usize>, Split, &str)> = Vec::new();
    for sample in &part.samples {
        let first = sample.key.rsplit('-').next().and_then(|first| first.parse::<usize>().ok());
        let first = first.with_context(|| format!("the key {} does not end in its first frame", sample.key))?;
        samples.push((first..first + sample.n_frames, sample.split, &sample.key));
    }
    samples.sort_by_key(|(frames, ..)| frames.start);
    // Blocks end on frames, rounded as seconds.
    let half = info.fps.secs(1) / 2.0;
    for (frames, split, key) in &samples {
        let (start, end) = (info.fps.secs(frames.start), info.fps.secs(frames.end));
        let holds = part.blocks.iter().any(|block| {
            block.split == Some(*split) && block.start_secs - half <= start && end <= block.end_secs + half
        });
        ensure!(holds, "the sample {key} is not in a block of the {} split", split.name());
    }
    for (n, (frames, split, key)) in samples.iter().enumerate() {
        let Some((next, other, other_key)) = samples[n + 1..].iter().find(|(_, other, _)| other != split) else {
            continue;
        };
        let apart = info.fps.secs(next.start) - info.fps.secs(frames.end);
        ensure!(
            apart >= rule.guard_secs - half,
            "{key} ({}) and {other_key} ({}) are {apart:.2} s apart, two splits must be {:.2} s apart",
            split.name(),
            other.name(),
            rule.guard_secs
        );
    }
    Ok(())
}
