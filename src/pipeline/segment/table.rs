//! The rules as tables, a row each: which measure, what it must reach or not exceed, how long a failure is let through.
//! Rows stand in the order in which they have their say. Thresholds come from `[segment]` of the configuration.

use super::measure::Measures;
use orator_base::stage::refusal::Refusal;
use orator_dataset::config;

/// Share of the frames of a gap of a hand from which on it is called the other hand's.
const MOST_OTHER: f64 = 0.3;

/// What a value must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    AtLeast(f64),
    AtMost(f64),
}

/// How long frames may fail and are kept all the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gap {
    /// This many seconds, wherever it is.
    Anywhere(f64),
    /// This many seconds between two good frames of a shot: it is filled from both.
    Inside(f64),
}

/// A rule on frames. What is refused is a run of failing frames of a shot, longer than the gap.
#[derive(Clone, Copy)]
pub struct FrameRule {
    pub refusal: Refusal,
    pub values: fn(&Measures) -> &[f32],
    pub bound: Bound,
    pub gap: Gap,
    /// The ledger says how long the run is instead of the mean value.
    pub measures_secs: bool,
    /// The value compares with the frame before: it says nothing of a shot's first frame.
    pub compares: bool,
    /// Holds where the hands rest on each other, whatever the value.
    pub spares_rest: bool,
}

/// A rule on pieces: the measure of frames of which too many, or too few, are in a piece of good frames.
#[derive(Clone, Copy)]
pub struct PieceRule {
    pub refusal: Refusal,
    pub values: fn(&Measures) -> &[f32],
    /// Which frames count...
    pub counted: Bound,
    /// ...and what share of the piece they must be, 0..1.
    pub share: Bound,
    /// Whether frames in which the hands rest on each other count as well.
    pub spares_rest: bool,
}

impl Bound {
    /// The threshold itself.
    pub const fn threshold(self) -> f64 {
        match self {
            Self::AtLeast(threshold) | Self::AtMost(threshold) => threshold,
        }
    }

    /// Whether `value` is as it must be; one that is not known (NaN) is.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::AtLeast(least) => value.is_nan() || value >= least,
            Self::AtMost(most) => value.is_nan() || value <= most,
        }
    }
}

/// The rules on frames.
pub fn frame_rules(rules: &config::SegmentConfig) -> [FrameRule; 16] {
    use Bound::{AtLeast, AtMost};
    let score = AtLeast(rules.joint_score);
    let row = |refusal, values: fn(&Measures) -> &[f32], bound, gap| FrameRule {
        refusal,
        values,
        bound,
        gap,
        measures_secs: false,
        compares: false,
        spares_rest: false,
    };
    let secs = |rule| FrameRule { measures_secs: true, ..rule };
    let hands = |rule| FrameRule { measures_secs: true, spares_rest: true, ..rule };
    let (none, body, hand) =
        (Gap::Anywhere(0.0), Gap::Inside(rules.max_body_gap_secs), Gap::Anywhere(rules.max_hand_gap_secs));
    let (quiet, still) = (Gap::Anywhere(rules.max_quiet_secs), Gap::Anywhere(rules.max_still_secs));
    [
        row(Refusal::NoSound, |m| &m.sound, AtLeast(0.5), none),
        row(Refusal::Quiet, |m| &m.sound_db, AtLeast(rules.min_sound_db), quiet),
        row(Refusal::NoSpeech, |m| &m.speech, AtLeast(rules.min_speech), quiet),
        row(Refusal::OffScreenSpeaker, |m| &m.lip_sync, AtLeast(rules.min_lip_sync), quiet),
        secs(row(Refusal::Static, |m| &m.frame_difference, AtLeast(rules.min_change), still)),
        row(Refusal::NoPerson, |m| &m.person, score, body),
        row(Refusal::Small, |m| &m.shoulder_px, AtLeast(rules.min_shoulder_px), body),
        row(Refusal::Face, |m| &m.face, score, body),
        row(Refusal::Turned, |m| &m.facing, AtLeast(rules.min_facing), body),
        row(Refusal::NoseOff, |m| &m.nose_off, AtMost(rules.max_nose_off), body),
        row(Refusal::Arms, |m| &m.arms, score, body),
        hands(row(Refusal::OtherHand, |m| &m.left_other, AtMost(MOST_OTHER), hand)),
        hands(row(Refusal::OtherHand, |m| &m.right_other, AtMost(MOST_OTHER), hand)),
        hands(row(Refusal::HandGap, |m| &m.left_hand, score, hand)),
        hands(row(Refusal::HandGap, |m| &m.right_hand, score, hand)),
        FrameRule { compares: true, ..row(Refusal::Jump, |m| &m.jump, AtMost(rules.max_jump), none) },
    ]
}

/// The rules on pieces of good frames.
pub fn piece_rules(rules: &config::SegmentConfig) -> [PieceRule; 3] {
    use Bound::{AtLeast, AtMost};
    let row = |refusal, values: fn(&Measures) -> &[f32], counted, share| PieceRule {
        refusal,
        values,
        counted,
        share,
        spares_rest: matches!(refusal, Refusal::HandShare),
    };
    let (seen, often) = (AtLeast(rules.joint_score), AtLeast(rules.min_hand_share));
    let crowd = AtLeast(f64::from(rules.max_people) + 0.5);
    [
        row(Refusal::HandShare, |m| &m.left_hand, seen, often),
        row(Refusal::HandShare, |m| &m.right_hand, seen, often),
        row(Refusal::Crowd, |m| &m.n_people, crowd, AtMost(rules.max_crowd_share)),
    ]
}
