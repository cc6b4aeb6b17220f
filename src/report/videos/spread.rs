//! Distributions of every measure over all frames of all videos, and of the lengths of kept intervals.

use crate::config::Settings;
use crate::pipeline::segment::Measures;
use crate::report::html::chart::histogram::{Counts, ThresholdLine};
use crate::stage::ledger::Ledger;

/// Measure: its array, title, unit, range and number of its bins, its threshold, and whether that is a minimum.
struct Measure {
    name: &'static str,
    title: &'static str,
    unit: &'static str,
    ends: [f64; 2],
    n_bins: usize,
    threshold: (&'static str, fn(&Settings) -> f64, bool),
}

const fn row(
    name: &'static str,
    title: &'static str,
    unit: &'static str,
    ends: [f64; 2],
    n_bins: usize,
    threshold: (&'static str, fn(&Settings) -> f64, bool),
) -> Measure {
    Measure { name, title, unit, ends, n_bins, threshold }
}

const SCORE: (&str, fn(&Settings) -> f64, bool) = ("joint_score", |s| s.segment.joint_score, true);
const ONE: [f64; 2] = [0.0, 1.0];
/// Names of what is not in `measures.npz` of the segment stage.
const BONES: &str = "bone_change";
const LENGTHS: &str = "interval_secs";

const ROWS: [Measure; 15] = [
    row(
        "sound_db",
        "Loudness of the second",
        "dB",
        [-100.0, 0.0],
        50,
        ("min_sound_db", |s| s.segment.min_sound_db, true),
    ),
    row(
        "still",
        "Change of the picture",
        "8-bit steps",
        [0.0, 4.0],
        80,
        ("min_change", |s| s.segment.min_change, true),
    ),
    row("person", "Best score of face and arms", "", ONE, 40, SCORE),
    row(
        "shoulder_px",
        "Between the shoulders",
        "px",
        [0.0, 600.0],
        60,
        ("min_shoulder_px", |s| s.segment.min_shoulder_px, true),
    ),
    row("face", "Score of nose and eyes", "", ONE, 40, SCORE),
    row(
        "facing",
        "Width of the shoulders",
        "neck-nose",
        [-2.0, 4.0],
        60,
        ("min_facing", |s| s.segment.min_facing, true),
    ),
    row(
        "nose_off",
        "Nose beside the neck",
        "half shoulders",
        [0.0, 3.0],
        60,
        ("max_nose_off", |s| s.segment.max_nose_off, false),
    ),
    row("arms", "Lowest score of shoulders and elbows", "", ONE, 40, SCORE),
    row("left_hand", "Score of the left hand", "", ONE, 40, SCORE),
    row("right_hand", "Score of the right hand", "", ONE, 40, SCORE),
    row("jump", "Step of the neck", "shoulder widths", [0.0, 1.5], 60, ("max_jump", |s| s.segment.max_jump, false)),
    row("shot_score", "Shot score", "", ONE, 50, ("shot_threshold", |s| s.segment.shot_threshold, false)),
    row(
        "n_people",
        "People in view",
        "people",
        [-0.5, 10.5],
        11,
        ("max_people", |s| f64::from(s.segment.max_people), false),
    ),
    row(
        BONES,
        "Lifted bone off its length",
        "of its length",
        [0.0, 1.5],
        60,
        ("max_bone_change", |s| s.lift.max_bone_change, false),
    ),
    row(
        LENGTHS,
        "Length of kept stretches",
        "s",
        [0.0, 60.0],
        60,
        ("min_frames", |s| s.segment.min_frames as f64, true),
    ),
];

/// Counts of all measures.
pub struct MeasureCounts(Vec<Counts>);

/// Histogram of a measure.
pub struct MeasureHistogram<'a> {
    pub title: &'static str,
    pub key: &'static str,
    pub unit: &'static str,
    pub counts: &'a Counts,
    pub threshold: ThresholdLine,
    /// Noun of what is counted.
    pub of: &'static str,
}

impl MeasureCounts {
    pub fn new() -> Self {
        Self(ROWS.iter().map(|row| Counts::new(row.ends[0], row.ends[1], row.n_bins)).collect())
    }

    fn add(&mut self, name: &str, values: impl Iterator<Item = f64>) {
        if let Some((counts, _)) = self.0.iter_mut().zip(&ROWS).find(|(_, row)| row.name == name) {
            values.for_each(|value| counts.add(value));
        }
    }

    /// Counts the frames of a video.
    pub fn add_frames(&mut self, measures: &Measures) {
        for (name, values) in measures.arrays() {
            self.add(name, values.iter().map(|value| f64::from(*value)));
        }
    }

    /// Counts the bone changes of a video's frames.
    pub fn add_bones(&mut self, bone_change: &[f32]) {
        self.add(BONES, bone_change.iter().map(|value| f64::from(*value)));
    }

    /// Counts the intervals that a video keeps.
    pub fn add_kept(&mut self, ledger: &Ledger) {
        self.add(LENGTHS, ledger.kept.iter().map(|kept| kept.end_secs - kept.start_secs));
    }

    /// Histograms of all measures with thresholds under `settings` for videos of `per_sec` frames a second.
    pub fn shown(&self, settings: &Settings, per_sec: f64) -> Vec<MeasureHistogram<'_>> {
        let shown = self.0.iter().zip(&ROWS).map(|(counts, row)| {
            let (key, value, is_least) = row.threshold;
            let is_length = row.name == LENGTHS;
            let value = if is_length { value(settings) / per_sec.max(1e-9) } else { value(settings) };
            let of = if is_length { "stretch" } else { "frame" };
            let threshold = ThresholdLine { value, is_least };
            MeasureHistogram { title: row.title, key, unit: row.unit, counts, threshold, of }
        });
        shown.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stage::ledger::Kept;

    #[test]
    fn every_measure_is_counted_but_the_two_that_are_yes_or_no() {
        let names = Measures::default().arrays().map(|(name, _)| name);
        let missing: Vec<&str> = names.into_iter().filter(|name| ROWS.iter().all(|row| row.name != *name)).collect();
        assert_eq!(missing, ["sound", "identity"]);
        let mut spread = MeasureCounts::new();
        let measures = Measures { jump: vec![0.1, 0.7, f32::NAN], ..Measures::default() };
        spread.add_frames(&measures);
        spread.add_kept(&Ledger { kept: vec![Kept { start_secs: 1.0, end_secs: 9.0 }], ..Ledger::default() });
        let shown = spread.shown(&Settings::default(), 15.0);
        let of = |key: &str| shown.iter().find(|row| row.key == key).unwrap();
        assert_eq!((of("max_jump").counts.total(), of("max_jump").counts.unknown), (2, 1));
        assert!((of("min_frames").threshold.value - 64.0 / 15.0).abs() < 1e-9);
        assert_eq!(of("min_frames").counts.bins[8], 1);
    }
}
