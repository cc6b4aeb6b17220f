//! Thresholds of `[segment]` that have sliders, with their descriptions and grids of values.

use orator_dataset::config::SegmentConfig;

/// Number of steps between the ends of a grid.
const N_STEPS: u32 = 20;

pub struct ThresholdGrid {
    /// Key in `[segment]`.
    pub key: &'static str,
    pub description: &'static str,
    /// Unit; empty for a score or share in 0..1 and for a count that the description names.
    pub unit: &'static str,
    pub low: f64,
    pub high: f64,
    pub get: fn(&SegmentConfig) -> f64,
    pub set: fn(&mut SegmentConfig, f64),
}

/// Converts a field to f64; the second argument is the type of an integer field.
macro_rules! as_number {
    ($value:expr, usize) => {
        $value as f64
    };
    ($value:expr, $integer:ident) => {
        f64::from($value)
    };
    ($value:expr) => {
        $value
    };
}

/// Defines a [`ThresholdGrid`]: key, description, unit, ends of the grid, and the type of an integer field.
macro_rules! row {
    ($key:ident, $description:literal, $unit:literal, $low:literal, $high:literal $(, $integer:ident)?) => {
        ThresholdGrid {
            key: stringify!($key),
            description: $description,
            unit: $unit,
            low: $low,
            high: $high,
            get: |rules| as_number!(rules.$key $(, $integer)?),
            set: |rules, value| rules.$key = value $(as $integer)?,
        }
    };
}

pub const THRESHOLDS: [ThresholdGrid; 19] = [
    row!(min_sound_db, "minimum loudness of the second around a frame", "dBFS", -90.0, -10.0),
    row!(min_speech, "minimum share of speech in the 4 s around a frame", "", 0.0, 1.0),
    row!(min_own_voice, "minimum probability that the voice is that of the visible mouth", "", 0.0, 1.0),
    row!(max_quiet_secs, "longest accepted pause in speech", "s", 0.0, 10.0),
    row!(
        min_change,
        "minimum picture change between frames; below it the picture is static",
        "levels (8-bit)",
        0.0,
        1.0
    ),
    row!(max_static_secs, "longest accepted static picture", "s", 0.0, 1.0),
    row!(joint_score, "minimum score of a visible face, arm or hand keypoint", "", 0.0, 1.0),
    row!(min_shoulder_px, "minimum distance between the shoulders", "px", 10.0, 210.0),
    row!(
        min_facing,
        "minimum shoulder width: 2 from the front, 0 from the side",
        "\u{d7} neck-nose distance",
        -1.0,
        3.0
    ),
    row!(max_nose_off, "maximum horizontal distance from nose to neck", "\u{d7} half shoulder width", 0.0, 4.0),
    row!(max_body_gap_secs, "longest gap of face or arms that is filled", "s", 0.0, 1.0),
    row!(max_hand_gap_secs, "longest gap of a hand that is masked", "s", 0.0, 1.0),
    row!(min_hand_share, "minimum share of an interval in which each hand is visible", "", 0.0, 1.0),
    row!(max_rest_move, "maximum wrist movement of resting hands within a second", "\u{d7} shoulder width", 0.0, 0.4),
    row!(max_jump, "maximum neck movement between two frames", "\u{d7} shoulder width", 0.1, 2.1),
    row!(shot_threshold, "minimum shot score of the first frame of a shot", "", 0.0, 1.0),
    row!(max_persons, "maximum number of persons in view", "", 1.0, 21.0, u32),
    row!(max_crowd_share, "maximum share of an interval with more persons", "", 0.0, 1.0),
    row!(min_frames, "minimum length of an accepted interval", "frames", 16.0, 176.0, usize),
];

impl ThresholdGrid {
    /// Values of the grid in ascending order, including the configured one, and the index of the latter.
    pub fn grid(&self, rules: &SegmentConfig) -> (Vec<f64>, usize) {
        let configured = (self.get)(rules);
        let step = (self.high - self.low) / f64::from(N_STEPS);
        let round = |value: f64| (value * 1000.0).round() / 1000.0;
        let mut grid: Vec<f64> = (0..=N_STEPS).map(|i| round(self.low + f64::from(i) * step)).collect();
        grid.retain(|value| (value - configured).abs() > 1e-9);
        let at = grid.iter().filter(|value| **value < configured).count();
        grid.insert(at, configured);
        (grid, at)
    }

    pub fn with(&self, rules: &SegmentConfig, value: f64) -> SegmentConfig {
        let mut other = rules.clone();
        (self.set)(&mut other, value);
        other
    }

    /// Value in the format of `pipeline.toml`.
    pub fn written(&self, value: f64) -> String {
        match self.key {
            "max_persons" | "min_frames" => format!("{value:.0}"),
            _ => format!("{value:?}"),
        }
    }
}
