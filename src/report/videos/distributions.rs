//! Histograms, with their thresholds, of every measure over all frames and of the lengths of accepted intervals.

use super::thresholds::THRESHOLDS;
use crate::html::chart::histogram::{Counts, ThresholdLine, histogram};
use crate::html::{Node, node};
use orator_base::stage::ledger::Ledger;
use orator_base::text::{counted, percent};
use orator_dataset::config::Settings;
use orator_pipeline::segment::Measures;

pub struct Measure {
    /// Name of the array in `measures.npz`, or `BONES` or `LENGTHS`.
    name: &'static str,
    pub title: &'static str,
    pub unit: &'static str,
    ends: [f64; 2],
    n_bins: usize,
    /// Key of the threshold in `[segment]`, or `max_bone_change` of `[lift]`.
    pub key: &'static str,
}

const fn row(
    name: &'static str,
    title: &'static str,
    unit: &'static str,
    ends: [f64; 2],
    n_bins: usize,
    key: &'static str,
) -> Measure {
    Measure { name, title, unit, ends, n_bins, key }
}

const UNIT_RANGE: [f64; 2] = [0.0, 1.0];
/// Names of measures that are not in `measures.npz`.
const BONES: &str = "bone_change";
const LENGTHS: &str = "interval_secs";

const ROWS: [Measure; 18] = [
    row("sound_db", "Loudness", "dBFS", [-100.0, 0.0], 50, "min_sound_db"),
    row("speech", "Share of speech", "", UNIT_RANGE, 50, "min_speech"),
    row("lip_sync", "Probability that the visible mouth speaks", "", UNIT_RANGE, 50, "min_own_voice"),
    row("still", "Picture change", "levels (8-bit)", [0.0, 4.0], 80, "min_change"),
    row("person", "Highest score of face and arms", "", UNIT_RANGE, 40, "joint_score"),
    row("shoulder_px", "Distance between the shoulders", "px", [0.0, 600.0], 60, "min_shoulder_px"),
    row("face", "Score of nose and eyes", "", UNIT_RANGE, 40, "joint_score"),
    row("facing", "Shoulder width", "\u{d7} neck-nose distance", [-2.0, 4.0], 60, "min_facing"),
    row(
        "nose_off",
        "Horizontal distance from nose to neck",
        "\u{d7} half shoulder width",
        [0.0, 4.0],
        60,
        "max_nose_off",
    ),
    row("arms", "Lowest score of shoulders and elbows", "", UNIT_RANGE, 40, "joint_score"),
    row("left_hand", "Score of the left hand", "", UNIT_RANGE, 40, "joint_score"),
    row("right_hand", "Score of the right hand", "", UNIT_RANGE, 40, "joint_score"),
    row("rest", "Wrist movement of resting hands", "\u{d7} shoulder width", UNIT_RANGE, 50, "max_rest_move"),
    row("jump", "Neck movement per frame", "\u{d7} shoulder width", [0.0, 1.5], 60, "max_jump"),
    row("shot_score", "Shot score", "", UNIT_RANGE, 50, "shot_threshold"),
    row("n_people", "Persons in view", "", [-0.5, 10.5], 11, "max_persons"),
    row(BONES, "Deviation of lifted bones from their length", "\u{d7} length", [0.0, 1.5], 60, "max_bone_change"),
    row(LENGTHS, "Length of accepted intervals", "s", [0.0, 60.0], 60, "min_frames"),
];

impl Measure {
    /// Noun for what the histogram counts.
    pub fn of(&self) -> &'static str {
        if self.name == LENGTHS { "interval" } else { "frame" }
    }

    /// Configured threshold, for videos with `per_sec` frames per second.
    pub fn threshold(&self, settings: &Settings, per_sec: f64) -> ThresholdLine {
        let of_segment = THRESHOLDS.iter().find(|threshold| threshold.key == self.key);
        let value = of_segment.map_or(settings.lift.max_bone_change, |threshold| (threshold.get)(&settings.segment));
        let value = if self.name == LENGTHS { value / per_sec.max(1e-9) } else { value };
        ThresholdLine { value, is_minimum: self.key.starts_with("min") || self.key == "joint_score" }
    }
}

pub struct MeasureCounts(Vec<Counts>);

impl MeasureCounts {
    pub fn new() -> Self {
        Self(ROWS.iter().map(|row| Counts::new(row.ends[0], row.ends[1], row.n_bins)).collect())
    }

    pub fn all(&self) -> impl Iterator<Item = (&'static Measure, &Counts)> {
        ROWS.iter().zip(&self.0)
    }

    fn add(&mut self, name: &str, values: impl Iterator<Item = f64>) {
        if let Some((counts, _)) = self.0.iter_mut().zip(&ROWS).find(|(_, row)| row.name == name) {
            values.for_each(|value| counts.add(value));
        }
    }

    pub fn add_frames(&mut self, measures: &Measures) {
        for (name, values) in measures.arrays() {
            self.add(name, values.iter().map(|value| f64::from(*value)));
        }
    }

    /// Counts the bone length changes of a video's frames.
    pub fn add_bones(&mut self, bone_change: &[f32]) {
        self.add(BONES, bone_change.iter().map(|value| f64::from(*value)));
    }

    pub fn add_intervals(&mut self, ledger: &Ledger) {
        self.add(LENGTHS, ledger.accepted.iter().map(|accepted| accepted.end_secs - accepted.start_secs));
    }
}

pub fn distributions(measures: &MeasureCounts, settings: &Settings, per_sec: f64) -> Vec<Node> {
    let about = "All frames of all videos, including rejected ones. Values below a minimum or above a maximum have \
                 another colour. Bar heights are proportional to the square root of the share, so that rare values stay \
                 visible; the outer bars include all values beyond the axis.";
    let cards = measures.all().map(|(measure, counts)| card(measure, counts, measure.threshold(settings, per_sec)));
    vec![node("p").text(about), node("div").class("grid").children(cards)]
}

fn card(shown: &Measure, counts: &Counts, threshold: ThresholdLine) -> Node {
    let title = node("h3").text(shown.title);
    let key = node("code").text(shown.key);
    let card = node("div").class("card distribution").child(title).child(node("small").child(key));
    if counts.total() == 0 {
        let unknown = if counts.unknown > 0 { "Not available for any frame." } else { "No measurements." };
        return card.child(node("p").class("empty").text(unknown));
    }
    let (total, unknown) = (counts.total() as f64, counts.unknown as f64);
    let beyond = (0..counts.bins.len()).filter(|bin| {
        let middle = (counts.edge(*bin) + counts.edge(bin + 1)) / 2.0;
        if threshold.is_minimum { middle < threshold.value } else { middle > threshold.value }
    });
    let beyond: u64 = beyond.map(|bin| counts.bins[bin]).sum();
    let beyond = percent(beyond as f64, total);
    let of_unknown = format!("; unknown for {}", percent(unknown, total + unknown));
    let side = if threshold.is_minimum { "below" } else { "above" };
    let description =
        format!("about {beyond} {side} the threshold{}", if unknown > 0.0 { of_unknown.as_str() } else { "" });
    let what = counted(counts.total() as usize, shown.of());
    let label = format!("{}, {what}: {description}", shown.title);
    card.child(histogram(&label, counts, shown.unit, Some(threshold)))
        .child(node("small").text(format!("{what}, {description}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::stage::ledger::AcceptedInterval;

    #[test]
    fn every_measure_is_counted_except_boolean_ones() {
        let names = Measures::default().arrays().map(|(name, _)| name);
        let missing: Vec<&str> = names.into_iter().filter(|name| ROWS.iter().all(|row| row.name != *name)).collect();
        assert_eq!(missing, ["sound", "left_other", "right_other", "identity"]);
        let mut counts = MeasureCounts::new();
        let measures = Measures { jump: vec![0.1, 0.7, f32::NAN], ..Measures::default() };
        counts.add_frames(&measures);
        counts.add_intervals(&Ledger {
            accepted: vec![AcceptedInterval { start_secs: 1.0, end_secs: 9.0 }],
            ..Ledger::default()
        });
        let of = |key: &str| counts.all().find(|(row, _)| row.key == key).unwrap();
        assert_eq!((of("max_jump").1.total(), of("max_jump").1.unknown), (2, 1));
        let (row, lengths) = of("min_frames");
        assert!((row.threshold(&Settings::default(), 15.0).value - 64.0 / 15.0).abs() < 1e-9);
        assert_eq!(lengths.bins[8], 1);
        let keys = THRESHOLDS.map(|threshold| threshold.key);
        assert!(ROWS.iter().all(|row| row.name == BONES || keys.contains(&row.key)));
    }
}
