//! Why a stretch is not kept: a word for programs, a sentence for people.

/// The reasons, in the order in which they are looked for: a frame is refused for the first that holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Refusal {
    /// No sound at all, or it ends before the picture: seconds of sound, seconds of picture.
    NoSound,
    /// The loudest sample and what it must reach, dB below full scale.
    Silent,
    /// Best score of face and arms.
    NoPerson,
    /// Pixels between the shoulders.
    Small,
    /// Score of nose and eyes.
    Face,
    /// Lowest score of shoulders and elbows.
    Arms,
    /// Seconds for which a hand is missing.
    HandGap,
    /// Shoulder widths the neck moves within a frame.
    Jump,
    /// Seconds that a shot boundary leaves of a stretch.
    Cut,
    /// Seconds of a stretch that other refusals leave.
    TooShort,
    /// Share of the frames in which the less visible hand is seen.
    HandShare,
}

impl Refusal {
    /// Every reason.
    pub const ALL: [Refusal; 11] = [
        Refusal::NoSound,
        Refusal::Silent,
        Refusal::NoPerson,
        Refusal::Small,
        Refusal::Face,
        Refusal::Arms,
        Refusal::HandGap,
        Refusal::Jump,
        Refusal::Cut,
        Refusal::TooShort,
        Refusal::HandShare,
    ];

    /// The reason in the ledger.
    pub const fn reason(self) -> &'static str {
        match self {
            Refusal::NoSound => "no sound",
            Refusal::Silent => "silent",
            Refusal::NoPerson => "no person",
            Refusal::Small => "too small",
            Refusal::Face => "face",
            Refusal::Arms => "arms",
            Refusal::HandGap | Refusal::HandShare => "hands",
            Refusal::Jump => "jump",
            Refusal::Cut => "cut",
            Refusal::TooShort => "too short",
        }
    }

    /// What `measured` and `threshold` are given in; empty: scores and shares, 0 to 1.
    pub const fn unit(self) -> &'static str {
        match self {
            Refusal::NoSound | Refusal::HandGap | Refusal::Cut | Refusal::TooShort => "s",
            Refusal::Silent => "dB",
            Refusal::Small => "px",
            Refusal::Jump => "shoulder widths",
            Refusal::NoPerson | Refusal::Face | Refusal::Arms | Refusal::HandShare => "",
        }
    }

    /// The sentence, with what was measured and the threshold.
    pub fn says(self, measured: f64, threshold: f64) -> String {
        let (m, t) = (measured, threshold);
        match self {
            Refusal::NoSound => format!("no sound: the sound lasts {m:.1} s, the picture {t:.1} s"),
            Refusal::Silent => format!("silent: the loudest sample is at {m:.0} dB, at least {t:.0} dB is needed"),
            Refusal::NoPerson => format!("no person: face and arms score {m:.2} at best, {t:.2} is needed"),
            Refusal::Small => format!("too small: {m:.0} px between the shoulders, {t:.0} px are needed"),
            Refusal::Face => format!("the face is not visible: nose and eyes score {m:.2}, {t:.2} is needed"),
            Refusal::Arms => format!("the arms are not visible: shoulders and elbows score {m:.2}, {t:.2} is needed"),
            Refusal::HandGap => format!("a hand is not visible for {m:.1} s, {t:.1} s are allowed"),
            Refusal::Jump => format!("the neck jumps by {m:.2} shoulder widths in a frame, {t:.2} are allowed"),
            Refusal::Cut => format!("a cut of the film leaves {m:.1} s, an interval needs {t:.1} s"),
            Refusal::TooShort => format!("too short: {m:.1} s between refused stretches, an interval needs {t:.1} s"),
            Refusal::HandShare => format!("a hand is seen in only {m:.2} of the frames, {t:.2} is needed"),
        }
    }
}
