//! Accepted seconds with other thresholds: the rules of `segment` are applied again to the stored measures, and those
//! of `lift` to the stored bone changes, with one threshold at each value of its grid and the others as configured.
//! Frames that lifting left open stay rejected; frames that were never lifted count as good.

use super::thresholds::THRESHOLDS;
use orator_base::stage::ledger::Ledger;
use orator_base::stage::rejection::{FrameRejection, Rejection};
use orator_dataset::config::SegmentConfig;
use orator_formats::media_json::MediaInfo;
use orator_pipeline::lift::reject::{bone_rejections, exclude_frames, max_gap_frames};
use orator_pipeline::segment;
use orator_pipeline::segment::Measures;
use rayon::prelude::*;

/// Accepted seconds of one video, by threshold and by value of its grid.
pub type AcceptedByThreshold = Vec<Vec<f64>>;

/// Data of a video that the rules depend on.
pub struct JudgedVideo<'a> {
    pub measures: &'a Measures,
    pub video: &'a MediaInfo,
    /// Relative change of bone length in each frame, measured by the lift stage; empty if the video is not lifted.
    pub bone_change: &'a [f32],
    /// Largest accepted relative change of a bone's length.
    pub max_bone_change: f64,
    /// Refusals of the frames that the lift stage left open; empty if the video is not lifted.
    pub open: &'a [Option<FrameRejection>],
}

impl JudgedVideo<'_> {
    /// Ledger of the video under `rules`.
    pub fn ledger(&self, rules: &SegmentConfig) -> Ledger {
        let (mut intervals, mut ledger) = segment::judge(self.measures, self.video, rules);
        let bones = bone_rejections(self.bone_change, self.max_bone_change, max_gap_frames(rules, self.video.fps));
        for rejections in [&bones[..], self.open] {
            if rejections.len() == intervals.n_frames
                && let Ok(left) = exclude_frames(&intervals, &ledger, rejections, rules.min_frames)
            {
                (intervals, ledger) = left;
            }
        }
        ledger
    }

    /// Accepted seconds under `rules`.
    pub fn accepted_secs(&self, rules: &SegmentConfig) -> f64 {
        self.ledger(rules).accepted_secs()
    }

    /// Accepted seconds at every value of every threshold, computed on all cores.
    pub fn table(&self, rules: &SegmentConfig) -> AcceptedByThreshold {
        let row = |threshold: &super::thresholds::ThresholdGrid| -> Vec<f64> {
            let (grid, _) = threshold.grid(rules);
            grid.into_par_iter().map(|value| self.accepted_secs(&threshold.with(rules, value))).collect()
        };
        THRESHOLDS.par_iter().map(row).collect()
    }
}

/// Rejection of each frame that the ledger of a lifted video lists as left open.
pub fn open_frames(ledger: &Ledger, video: &MediaInfo) -> Vec<Option<FrameRejection>> {
    let mut open = vec![None; video.n_frames];
    let is_open = |reason: &str, unit: &str| Rejection::find(reason, unit) == Some(Rejection::MissingJoints);
    for span in ledger.rejected.iter().filter(|span| is_open(&span.reason, &span.unit)) {
        let frame = |secs: f64| ((secs * video.fps.per_sec()).round() as usize).min(video.n_frames);
        // The video may end within the last frame.
        let end = if span.end_secs == video.duration_secs { video.n_frames } else { frame(span.end_secs) };
        let why = FrameRejection::new(Rejection::MissingJoints, span.measured, span.threshold);
        open[frame(span.start_secs).min(end)..end].fill(Some(why));
    }
    open
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::stage::ledger::RejectedInterval;
    use orator_base::types::time::FrameRate;

    /// Measures of 300 good frames, except for a jump at frame 200.
    fn measures() -> Measures {
        let of = |value: f32| vec![value; 300];
        let mut jump = of(0.0);
        jump[200] = 1.0;
        Measures {
            sound: of(1.0),
            sound_db: of(-20.0),
            speech: of(0.9),
            lip_sync: of(0.9),
            frame_difference: of(5.0),
            person: of(0.9),
            shoulder_px: of(120.0),
            face: of(0.9),
            facing: of(2.0),
            nose_off: of(0.0),
            arms: of(0.9),
            left_hand: of(0.9),
            right_hand: of(0.9),
            left_other: of(0.0),
            right_other: of(0.0),
            rest: of(10.0),
            n_persons: of(1.0),
            jump,
            identity: of(0.0),
            shot_score: of(0.0),
        }
    }

    #[test]
    fn other_thresholds_change_what_is_accepted_and_open_frames_stay_refused() {
        let video = MediaInfo::new(19.99, 300, FrameRate::new(15, 1));
        let (measures, rules) = (measures(), SegmentConfig::default());
        let max_bone_change = 0.4;
        let none = JudgedVideo { measures: &measures, video: &video, bone_change: &[], max_bone_change, open: &[] };
        assert!((none.accepted_secs(&rules) - (19.99 - 1.0 / 15.0)).abs() < 1e-9);
        let why = FrameRejection::new(Rejection::MissingJoints, 3.0, 0.0);
        let rejected = vec![RejectedInterval::new(12.0, 13.0, why), RejectedInterval::new(19.0, 19.99, why)];
        let open = open_frames(&Ledger { rejected, ..Ledger::default() }, &video);
        assert_eq!((open.iter().flatten().count(), open[180].is_some(), open[195].is_some()), (30, true, false));
        let mut bone_change = vec![0.1; 300];
        bone_change[150..165].fill(0.9);
        bone_change[20] = 0.9;
        let some = JudgedVideo { bone_change: &bone_change, open: &open, ..none };
        // Accepted are the frames 0..150 and 201..285; the remaining frames 165..180 and 195..200 are too short.
        assert!((some.accepted_secs(&rules) - (10.0 + 84.0 / 15.0)).abs() < 1e-9);
        let table = some.table(&rules);
        for (threshold, row) in THRESHOLDS.iter().zip(&table) {
            let (grid, at) = threshold.grid(&rules);
            assert_eq!((row.len(), row[at]), (grid.len(), some.accepted_secs(&rules)), "{}", threshold.key);
        }
        let jump = THRESHOLDS.iter().position(|threshold| threshold.key == "max_jump").unwrap();
        assert!((table[jump].last().unwrap() - (10.0 + 90.0 / 15.0)).abs() < 1e-9);
    }
}
