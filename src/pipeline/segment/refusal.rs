//! Why a stretch is not kept: a word for programs, a sentence for people.

/// The reasons, in the order in which they are looked for: a frame is refused for the first that holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Refusal {
    /// Share of the frames with sound.
    NoSound,
    /// Loudness, dB of full scale.
    Quiet,
    /// Seconds for which the picture stands still.
    Still,
    /// Best score of face and arms.
    NoPerson,
    /// Pixels between the shoulders.
    Small,
    /// Score of nose and eyes.
    Face,
    /// Width of the shoulders in distances from neck to nose.
    Turned,
    /// Half shoulder widths between nose and neck.
    NoseOff,
    /// Lowest score of shoulders and elbows.
    Arms,
    /// Seconds for which a hand is missing.
    HandGap,
    /// Shoulder widths the neck moves within a frame.
    Jump,
    /// Seconds that a shot boundary leaves of a stretch.
    Cut,
    /// Seconds that a change of the followed person leaves of a stretch.
    Identity,
    /// Seconds of a stretch that other refusals leave.
    TooShort,
    /// Share of the frames in which the less visible hand is seen.
    HandShare,
    /// Share of the frames with too many people.
    Crowd,
}

impl Refusal {
    /// Every reason.
    pub const ALL: [Refusal; 16] = [
        Refusal::NoSound,
        Refusal::Quiet,
        Refusal::Still,
        Refusal::NoPerson,
        Refusal::Small,
        Refusal::Face,
        Refusal::Turned,
        Refusal::NoseOff,
        Refusal::Arms,
        Refusal::HandGap,
        Refusal::Jump,
        Refusal::Cut,
        Refusal::Identity,
        Refusal::TooShort,
        Refusal::HandShare,
        Refusal::Crowd,
    ];

    /// The reason in the ledger.
    pub const fn reason(self) -> &'static str {
        match self {
            Refusal::NoSound => "no sound",
            Refusal::Quiet => "quiet",
            Refusal::Still => "still",
            Refusal::NoPerson => "no person",
            Refusal::Small => "too small",
            Refusal::Face => "face",
            Refusal::Turned | Refusal::NoseOff => "turned",
            Refusal::Arms => "arms",
            Refusal::HandGap | Refusal::HandShare => "hands",
            Refusal::Jump => "jump",
            Refusal::Cut => "cut",
            Refusal::Identity => "other person",
            Refusal::TooShort => "too short",
            Refusal::Crowd => "crowd",
        }
    }

    /// What `measured` and `threshold` are given in; empty: scores and shares, 0 to 1.
    pub const fn unit(self) -> &'static str {
        match self {
            Refusal::Still | Refusal::HandGap | Refusal::Cut | Refusal::Identity | Refusal::TooShort => "s",
            Refusal::Quiet => "dB",
            Refusal::Small => "px",
            Refusal::Turned => "neck-nose distances",
            Refusal::NoseOff => "half shoulder widths",
            Refusal::Jump => "shoulder widths",
            Refusal::NoSound
            | Refusal::NoPerson
            | Refusal::Face
            | Refusal::Arms
            | Refusal::HandShare
            | Refusal::Crowd => "",
        }
    }

    /// The sentence, with what was measured and the threshold.
    pub fn says(self, measured: f64, threshold: f64) -> String {
        let (m, t) = (measured, threshold);
        match self {
            Refusal::NoSound => "no sound: there is no track, or it has ended".to_owned(),
            Refusal::Quiet => format!("too quiet: the sound is at {m:.0} dB, {t:.0} dB is needed"),
            Refusal::Still => format!("the picture stands still for {m:.1} s, {t:.1} s are allowed"),
            Refusal::NoPerson => format!("no person: face and arms score {m:.2} at best, {t:.2} is needed"),
            Refusal::Small => format!("too small: {m:.0} px between the shoulders, {t:.0} px are needed"),
            Refusal::Face => format!("the face is not visible: nose and eyes score {m:.2}, {t:.2} is needed"),
            Refusal::Turned => {
                format!("turned away: the shoulders are {m:.2} neck-nose distances wide, {t:.2} are needed")
            }
            Refusal::NoseOff => {
                format!("turned sideways: the nose is {m:.2} half shoulder widths beside the neck, {t:.2} are allowed")
            }
            Refusal::Arms => format!("the arms are not visible: shoulders and elbows score {m:.2}, {t:.2} is needed"),
            Refusal::HandGap => format!("a hand is not visible for {m:.1} s, {t:.1} s are allowed"),
            Refusal::Jump => format!("the neck jumps by {m:.2} shoulder widths in a frame, {t:.2} are allowed"),
            Refusal::Cut => format!("a cut of the film leaves {m:.1} s, an interval needs {t:.1} s"),
            Refusal::Identity => format!("a change of person leaves {m:.1} s, an interval needs {t:.1} s"),
            Refusal::TooShort => format!("too short: {m:.1} s between refused stretches, an interval needs {t:.1} s"),
            Refusal::HandShare => format!("a hand is seen in only {m:.2} of the frames, {t:.2} is needed"),
            Refusal::Crowd => format!("too many people in {m:.2} of the frames, {t:.2} is allowed"),
        }
    }
}
