//! Assignment of videos, or time blocks of a video, to splits: from the record, the configuration, and the guard
//! interval between two splits of a video. A window of one split, including all frames that influence it, ends before
//! the first frame of a sample of another split.

use super::video::LiftedVideo;
use anyhow::{Result, ensure};
use orator_base::stage::Unit;
use orator_base::stage::artifacts::{self, StageName, dir};
use orator_base::stage::ledger::{AcceptedInterval, Ledger, RejectedInterval};
use orator_base::stage::rejection::{FrameRejection, Rejection};
use orator_base::text::counted;
use orator_base::types::interval::{Interval, Intervals};
use orator_base::types::time::FrameRate;
use orator_dataset::config::{self, Settings, SplitUnit};
use orator_dataset::info::DatasetInfo;
use orator_dataset::shared_sound::SharedSound;
use orator_dataset::split::{
    Assignment, RecordedSplit, Split, SplitBy, SplitPlan, SplitRecord, SplitRule, TimeBlock, Unassigned, assign, blocks,
};
use orator_dataset::{INFO, WINDOW_FRAMES};
use std::collections::BTreeMap;
use std::path::Path;

/// Least number of videos for splitting by video.
const MIN_VIDEOS: usize = 8;
/// Number of windows that fit into the shortest block.
const MIN_WINDOWS: usize = 2;

/// Division of a speaker's videos into splits.
pub struct Division {
    pub record: SplitRecord,
    /// Guard interval between two splits of a video, frames.
    pub guard_frames: usize,
    /// Least length of a sample that is cut from a block, frames.
    pub min_frames: usize,
}

/// Samples of a video divided into blocks, and the resulting ledger.
pub struct DividedVideo {
    pub pieces: Vec<(Split, Interval)>,
    pub ledger: Ledger,
}

/// Length of a training window in frames, at least that of the published model.
pub fn window_frames(settings: &Settings) -> usize {
    settings.gan.window_frames.max(WINDOW_FRAMES)
}

/// Guard interval in frames: a training window plus `context_secs`, the context beside a sample that its joints depend
/// on. Audio features have less context, and use only the sample's own audio.
pub fn guard_frames(settings: &Settings, context_secs: f64) -> usize {
    let context = context_secs * settings.extract.rate().per_sec();
    window_frames(settings) + context.ceil() as usize + 1
}

/// Recorded splits: of the work folder, else of the existing dataset.
pub fn recorded_splits(work: &Path, speaker: &Unit) -> Result<Option<SplitRecord>> {
    let record = SplitRecord::read(&artifacts::splits(work, &speaker.speaker))?;
    Ok(record.or_else(|| of_dataset(&dir(work, StageName::Dataset, speaker))))
}

/// Splits of the dataset in `dir`, if it states any.
fn of_dataset(dir: &Path) -> Option<SplitRecord> {
    let info: DatasetInfo = serde_json::from_slice(&std::fs::read(dir.join(INFO)).ok()?).ok()?;
    let (unit, why) = match info.split_rule {
        Some(rule) => (rule.unit, rule.why),
        None => (SplitUnit::Video, "as it was before".to_owned()),
    };
    let mut record = SplitRecord::new(unit, why);
    for video in info.videos.into_iter().filter(|video| video.split.is_some() || !video.blocks.is_empty()) {
        let (name, split, by, blocks) = (video.name, video.split, video.split_by, video.blocks);
        record.videos.insert(video.content, RecordedSplit { name, split, by, blocks });
    }
    Some(record).filter(|record| !record.videos.is_empty())
}

/// Record to continue: the existing one, unless the configuration now asks for another unit; else a new one.
pub fn choose_record(asked: SplitUnit, before: Option<SplitRecord>, n_videos: usize, are_named: bool) -> SplitRecord {
    let before = before.filter(|before| !before.videos.is_empty());
    match (asked, before) {
        (SplitUnit::Auto, Some(before)) => before,
        (SplitUnit::Auto, None) if are_named => {
            SplitRecord::new(SplitUnit::Video, "the configuration names the split of videos".to_owned())
        }
        (SplitUnit::Auto, None) => {
            let few = n_videos < MIN_VIDEOS;
            let unit = if few { SplitUnit::Time } else { SplitUnit::Video };
            let fewer = if few { "fewer than" } else { "at least" };
            let why = format!("chosen for {}, {fewer} {MIN_VIDEOS}", counted(n_videos, "video"));
            SplitRecord::new(unit, why)
        }
        (unit, Some(before)) if before.unit == unit => before,
        (unit, _) => SplitRecord::new(unit, "the configuration says so".to_owned()),
    }
}

impl Division {
    pub fn rule(&self, fps: FrameRate) -> SplitRule {
        let by_time = self.record.unit == SplitUnit::Time;
        let guard_secs = if by_time { fps.secs(self.guard_frames) } else { 0.0 };
        SplitRule { unit: self.record.unit, why: self.record.why.clone(), guard_secs }
    }

    /// Assigns the videos in order and records the splits. `named`: configured splits, by the video's work name.
    pub fn assign(
        &mut self,
        videos: &[&LiftedVideo],
        named: &BTreeMap<&str, Split>,
        shared: &[SharedSound],
        settings: &config::DatasetConfig,
    ) -> Vec<Assignment> {
        let Some(first) = videos.first() else { return Vec::new() };
        let fps = first.intervals.fps;
        let unassigned = videos.iter().map(|video| Unassigned {
            name: &video.name,
            content: &video.content,
            duration_secs: video.ledger.duration_secs,
            accepted: video.ledger.accepted.iter().map(|accepted| (accepted.start_secs, accepted.end_secs)).collect(),
            named: named.get(video.unit.video.as_str()).copied(),
            recorded: self.record.videos.get(&video.content),
        });
        let plan = SplitPlan {
            unit: self.record.unit,
            validation: settings.validation,
            test: settings.test,
            guard_secs: fps.secs(self.guard_frames),
            min_block_secs: fps.secs(MIN_WINDOWS * self.min_frames),
        };
        let assigned = assign(&unassigned.collect::<Vec<_>>(), shared, &plan);
        for (video, assignment) in videos.iter().zip(&assigned) {
            let (split, by, blocks) = match assignment {
                _ if video.ledger.accepted.is_empty() => continue,
                Assignment::In(split, by) => (Some(*split), by.clone(), Vec::new()),
                Assignment::Blocks(blocks) => (None, SplitBy::Time, blocks.clone()),
                Assignment::Excluded(_) => continue,
            };
            let recorded = RecordedSplit { name: video.name.clone(), split, by, blocks };
            self.record.videos.insert(video.content.clone(), recorded);
        }
        assigned
    }

    /// Cuts a video's intervals at its blocks.
    ///
    /// # Errors
    /// Intervals that do not match the ledger.
    pub fn divide(&self, intervals: &Intervals, ledger: &Ledger, blocks: &[TimeBlock]) -> Result<DividedVideo> {
        let fps = intervals.fps;
        ensure!(
            intervals.intervals.len() == ledger.accepted.len(),
            "a video has {}, but {} accepted in its ledger: run the stage lift again",
            counted(intervals.intervals.len(), "interval"),
            ledger.accepted.len()
        );
        let usable = blocks::usable(blocks, fps, intervals.n_frames, self.guard_frames);
        let mut divided =
            DividedVideo { pieces: Vec::new(), ledger: Ledger { accepted: Vec::new(), ..ledger.clone() } };
        for (interval, accepted) in intervals.intervals.iter().zip(&ledger.accepted) {
            let mut at = accepted.start_secs;
            for (split, block) in &usable {
                let piece = Interval { start: interval.start.max(block.start), end: interval.end.min(block.end) };
                if piece.n_frames() < self.min_frames.min(interval.n_frames()) {
                    continue;
                }
                // The ends of an interval are those of its ledger entry, where a partial last frame counts.
                let start_secs =
                    if piece.start == interval.start { accepted.start_secs } else { fps.secs(piece.start) };
                let end_secs = if piece.end == interval.end { accepted.end_secs } else { fps.secs(piece.end) };
                divided.ledger.rejected.extend(self.left_out(at, start_secs, blocks, fps));
                divided.ledger.accepted.push(AcceptedInterval { start_secs, end_secs });
                divided.pieces.push((*split, piece));
                at = end_secs;
            }
            divided.ledger.rejected.extend(self.left_out(at, accepted.end_secs, blocks, fps));
        }
        let pieces = divided.pieces.iter().map(|(_, piece)| *piece).collect();
        let resting = Intervals::new(fps, intervals.n_frames, pieces).with_resting(&intervals.resting);
        divided.ledger = divided.ledger.with_resting(resting.resting_intervals());
        divided.ledger.rejected.sort_by(|a, b| a.start_secs.total_cmp(&b.start_secs));
        Ok(divided)
    }

    /// Ledger entry for the time between two samples, if there is any.
    fn left_out(
        &self,
        start_secs: f64,
        end_secs: f64,
        blocks: &[TimeBlock],
        fps: FrameRate,
    ) -> Option<RejectedInterval> {
        if end_secs <= start_secs {
            return None;
        }
        let is_shared =
            |block: &TimeBlock| block.split.is_none() && block.start_secs < end_secs && start_secs < block.end_secs;
        if blocks.iter().any(is_shared) {
            let why = FrameRejection::new(Rejection::Duplicate, end_secs - start_secs, 0.0);
            let message = "another video has the same sound in another split".to_owned();
            return Some(RejectedInterval::with_message(start_secs, end_secs, why, message));
        }
        let why = FrameRejection::new(Rejection::SplitGap, end_secs - start_secs, fps.secs(self.guard_frames));
        Some(RejectedInterval::new(start_secs, end_secs, why))
    }
}
