//! Collection of all data of the report in a single pass over the videos. Only the summary of a video with its ledger
//! stays in memory.

use super::distributions::MeasureCounts;
use super::movement::MovementCounts;
use super::thresholds::THRESHOLDS;
use super::video::VideoSummary;
use super::what_if::{AcceptedByThreshold, JudgedVideo, open_frames};
use super::worst::Worst;
use crate::preview::{MAX_PREVIEWS, MotionPreview};
use anyhow::{Context, Result, ensure};
use orator_base::stage::Unit;
use orator_base::stage::artifacts::Artifact;
use orator_base::stage::progress::Progress;
use orator_base::types::interval::Intervals;
use orator_dataset::config::Settings;
use orator_dataset::config::videos::Videos;
use orator_formats::joints_npz;
use orator_formats::media_json::MediaInfo;
use orator_formats::npz::Npz;
use orator_pipeline::segment::Measures;
use std::path::Path;

/// Data of a report.
pub struct ReportData {
    pub videos: Vec<VideoSummary>,
    /// Results of `what_if` by video; `None`: the video has no measures.
    pub accepted: Vec<Option<AcceptedByThreshold>>,
    pub measures: MeasureCounts,
    pub movement: MovementCounts,
    pub worst: Worst,
    /// Animated previews of the first videos with accepted motion.
    pub previews: Vec<MotionPreview>,
    /// Messages about entries of the configuration that have no effect.
    pub missing: Vec<String>,
    /// Number of videos to which the speech model was applied, and number of measured videos.
    pub n_speech_model: (usize, usize),
}

/// Collects the data of all `videos`, with at most `n_pictures` moments per rule.
pub fn gather(settings: &Settings, videos: &[Videos], n_pictures: usize, progress: &dyn Progress) -> ReportData {
    let missing = videos.iter().flat_map(|of| of.missing.iter().map(move |text| format!("{}: {text}", of.speaker)));
    let mut all = ReportData {
        videos: Vec::new(),
        accepted: Vec::new(),
        measures: MeasureCounts::new(),
        movement: MovementCounts::new(),
        worst: Worst::new(n_pictures),
        previews: Vec::new(),
        missing: missing.collect(),
        n_speech_model: (0, 0),
    };
    let units: Vec<&Unit> = videos.iter().flat_map(|of| &of.units).collect();
    let task = progress.begin("reading", units.len() as u64);
    for unit in units {
        task.detail(&unit.video);
        let mut video = VideoSummary::read(&settings.work.dir, unit);
        let accepted = if video.ledger.failed.is_empty() && video.ledger.duration_secs > 0.0 {
            all.add(settings, &mut video)
        } else {
            None
        };
        all.accepted.push(accepted);
        all.videos.push(video);
        task.advance(1);
    }
    all
}

impl ReportData {
    /// Adds the measures of a video; unreadable data becomes a note. Returns the results of `what_if`.
    fn add(&mut self, settings: &Settings, video: &mut VideoSummary) -> Option<AcceptedByThreshold> {
        let rules = &settings.segment;
        let (work, unit) = (&settings.work.dir, video.unit.clone());
        self.measures.add_intervals(&video.ledger);
        let (measures, judged) = match read_measures(work, &unit) {
            Ok(found) => found,
            Err(error) => {
                video.note(&format!("Not included in the histograms and sliders: {error:#}"));
                return None;
            }
        };
        self.n_speech_model.0 += usize::from(measures.speech.iter().any(|share| !share.is_nan()));
        self.n_speech_model.1 += 1;
        self.measures.add_frames(&measures);
        let bones = if video.is_lifted { bone_change(work, &unit) } else { Ok(Vec::new()) };
        let bone_change = bones.unwrap_or_else(|error| {
            video.note(&format!("{error:#}"));
            Vec::new()
        });
        self.measures.add_bones(&bone_change);
        self.worst.add(self.videos.len(), &video.ledger, (&measures, &bone_change), &judged, rules);
        if video.is_lifted {
            match motion(work, &unit) {
                Ok((motion, intervals)) => {
                    self.movement.add(&motion, &intervals.intervals);
                    if self.previews.len() < MAX_PREVIEWS {
                        let preview = MotionPreview::new(&video.file, video.anchor(), &motion, &intervals.intervals);
                        self.previews.extend(preview);
                    }
                }
                Err(error) => video.note(&format!("The motion is not shown: {error:#}")),
            }
        }
        let open = open_frames(&video.ledger, &judged);
        let max_bone_change = settings.lift.max_bone_change;
        let judged = JudgedVideo {
            measures: &measures,
            video: &judged,
            bone_change: &bone_change,
            max_bone_change,
            open: &open,
        };
        let now = judged.accepted_secs(rules);
        if (now - video.ledger.accepted_secs()).abs() > 1e-6 {
            video.note(
                "The thresholds have changed since this video was processed; the sliders start at the new values. Run \
                 `orator run` to update it.",
            );
        }
        let accepted = judged.table(rules);
        debug_assert_eq!(accepted.len(), THRESHOLDS.len());
        Some(accepted)
    }
}

fn read_measures(work: &Path, unit: &Unit) -> Result<(Measures, MediaInfo)> {
    let judged = MediaInfo::read(&Artifact::MediaInfo.path(work, unit))?;
    let measures = Measures::read(&Artifact::Measures.path(work, unit))?;
    ensure!(
        measures.n_frames() == judged.n_frames,
        "the measures have {} frames, the video has {}: run the segment stage again",
        measures.n_frames(),
        judged.n_frames
    );
    Ok((measures, judged))
}

fn bone_change(work: &Path, unit: &Unit) -> Result<Vec<f32>> {
    let values = Npz::open(&Artifact::BoneChange.path(work, unit))?.floats("bone_change", &[None])?;
    Ok(values.into_iter().collect())
}

fn motion(work: &Path, unit: &Unit) -> Result<(orator_base::types::pose3d::Motion, Intervals)> {
    let path = Artifact::LiftIntervals.path(work, unit);
    let bytes = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let intervals =
        serde_json::from_slice(&bytes).with_context(|| format!("{} is not a list of intervals", path.display()))?;
    Ok((joints_npz::read(&Artifact::Joints.path(work, unit))?, intervals))
}
