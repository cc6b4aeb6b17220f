//! Tables of the rules, one row each: the measure, its bound, and how long it may fail. Rows are in order of
//! precedence. Thresholds come from `[segment]` of the configuration.

use super::measure::Measures;
use orator_base::stage::rejection::Rejection;
use orator_dataset::config;

/// Share of duplicate detections in a gap of a hand above which the gap is attributed to the other hand.
const MAX_DUPLICATE_SHARE: f64 = 0.3;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    AtLeast(f64),
    AtMost(f64),
}

/// How long frames may fail without being rejected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gap {
    /// This many seconds, anywhere.
    Anywhere(f64),
    /// This many seconds between two good frames of a shot, which allow interpolation.
    Inside(f64),
}

/// Rule on frames. It rejects runs of failing frames within a shot that are longer than the gap.
#[derive(Clone, Copy)]
pub struct FrameRule {
    pub rejection: Rejection,
    pub values: fn(&Measures) -> &[f32],
    pub bound: Bound,
    pub gap: Gap,
    /// The ledger states the length of the run instead of the mean value.
    pub measures_secs: bool,
    /// The value compares with the previous frame, so it does not apply to the first frame of a shot.
    pub compares_frames: bool,
    /// Satisfied where the hands rest on each other, whatever the value.
    pub allows_rest: bool,
}

/// Rule on segments, the runs of good frames: bounds the share of frames with a property.
#[derive(Clone, Copy)]
pub struct SegmentRule {
    pub rejection: Rejection,
    pub values: fn(&Measures) -> &[f32],
    /// Frames that are counted...
    pub counted: Bound,
    /// ...and the bound on their share of the segment, 0..1.
    pub share: Bound,
    /// Whether frames with resting hands are counted as well.
    pub allows_rest: bool,
}

impl Bound {
    pub const fn threshold(self) -> f64 {
        match self {
            Self::AtLeast(threshold) | Self::AtMost(threshold) => threshold,
        }
    }

    /// Whether `value` satisfies the bound; NaN (unknown) does.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::AtLeast(least) => value.is_nan() || value >= least,
            Self::AtMost(most) => value.is_nan() || value <= most,
        }
    }
}

pub fn frame_rules(rules: &config::SegmentConfig) -> [FrameRule; 16] {
    use Bound::{AtLeast, AtMost};
    let score = AtLeast(rules.joint_score);
    let row = |rejection, values: fn(&Measures) -> &[f32], bound, gap| FrameRule {
        rejection,
        values,
        bound,
        gap,
        measures_secs: false,
        compares_frames: false,
        allows_rest: false,
    };
    let secs = |rule| FrameRule { measures_secs: true, ..rule };
    let hands = |rule| FrameRule { measures_secs: true, allows_rest: true, ..rule };
    let (none, body, hand) =
        (Gap::Anywhere(0.0), Gap::Inside(rules.max_body_gap_secs), Gap::Anywhere(rules.max_hand_gap_secs));
    let (quiet, still) = (Gap::Anywhere(rules.max_quiet_secs), Gap::Anywhere(rules.max_static_secs));
    [
        row(Rejection::NoSound, |m| &m.sound, AtLeast(0.5), none),
        row(Rejection::Quiet, |m| &m.sound_db, AtLeast(rules.min_sound_db), quiet),
        row(Rejection::NoSpeech, |m| &m.speech, AtLeast(rules.min_speech), quiet),
        row(Rejection::OffScreenSpeaker, |m| &m.lip_sync, AtLeast(rules.min_own_voice), quiet),
        secs(row(Rejection::Static, |m| &m.frame_difference, AtLeast(rules.min_change), still)),
        row(Rejection::NoPerson, |m| &m.person, score, body),
        row(Rejection::Small, |m| &m.shoulder_px, AtLeast(rules.min_shoulder_px), body),
        row(Rejection::Face, |m| &m.face, score, body),
        row(Rejection::Turned, |m| &m.facing, AtLeast(rules.min_facing), body),
        row(Rejection::NoseOff, |m| &m.nose_off, AtMost(rules.max_nose_off), body),
        row(Rejection::Arms, |m| &m.arms, score, body),
        hands(row(Rejection::OtherHand, |m| &m.left_other, AtMost(MAX_DUPLICATE_SHARE), hand)),
        hands(row(Rejection::OtherHand, |m| &m.right_other, AtMost(MAX_DUPLICATE_SHARE), hand)),
        hands(row(Rejection::HandGap, |m| &m.left_hand, score, hand)),
        hands(row(Rejection::HandGap, |m| &m.right_hand, score, hand)),
        FrameRule { compares_frames: true, ..row(Rejection::Jump, |m| &m.jump, AtMost(rules.max_jump), none) },
    ]
}

pub fn segment_rules(rules: &config::SegmentConfig) -> [SegmentRule; 3] {
    use Bound::{AtLeast, AtMost};
    let row = |rejection, values: fn(&Measures) -> &[f32], counted, share| SegmentRule {
        rejection,
        values,
        counted,
        share,
        allows_rest: matches!(rejection, Rejection::HandShare),
    };
    let (visible, min_share) = (AtLeast(rules.joint_score), AtLeast(rules.min_hand_share));
    let crowded = AtLeast(f64::from(rules.max_persons) + 0.5);
    [
        row(Rejection::HandShare, |m| &m.left_hand, visible, min_share),
        row(Rejection::HandShare, |m| &m.right_hand, visible, min_share),
        row(Rejection::Crowd, |m| &m.n_persons, crowded, AtMost(rules.max_crowd_share)),
    ]
}
