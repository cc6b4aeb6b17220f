//! Why seconds of a video are not kept: the one list of reasons, each with its word for programs, the unit of what was
//! measured, a heading and a sentence for people.

/// A reason. Those of `JUDGED` come first, in the order in which they are looked for: a frame is refused for the first
/// that holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Refusal {
    /// Share of the frames with sound.
    NoSound,
    /// Loudness, dB of full scale.
    Quiet,
    /// Share of the sound that is speech.
    NoSpeech,
    /// Correlation of the mouth that is seen with the voice that is heard.
    OtherVoice,
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
    /// Seconds for which a hand is missing, the other one having been found in its place.
    OtherHand,
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
    /// Share of its length that a lifted bone is off it.
    Bones,
    /// Joints that stay unseen for longer than lifting fills.
    Open,
    /// Seconds that another video of the dataset has as well.
    Duplicate,
    /// Seconds left out between two splits of a video.
    Guard,
    /// An imported take without a sound, or the rest of one behind the end of its sound.
    NoSoundFile,
    /// An imported take that a model predicted.
    Prediction,
    /// Seconds by which sound and motion of an imported take differ in length.
    OutOfStep,
    /// Frames that motion and sound of an imported take have in common.
    FewFrames,
    /// Seconds that the imported shards leave out.
    NotImported,
}

impl Refusal {
    /// The reasons that `segment` and `lift` judge frames by.
    pub const JUDGED: [Self; 21] = [
        Self::NoSound,
        Self::Quiet,
        Self::NoSpeech,
        Self::OtherVoice,
        Self::Still,
        Self::NoPerson,
        Self::Small,
        Self::Face,
        Self::Turned,
        Self::NoseOff,
        Self::Arms,
        Self::OtherHand,
        Self::HandGap,
        Self::Jump,
        Self::Cut,
        Self::Identity,
        Self::TooShort,
        Self::HandShare,
        Self::Crowd,
        Self::Bones,
        Self::Open,
    ];

    /// The judged reason of a ledger's entry with this word and unit.
    pub fn find(reason: &str, unit: &str) -> Option<Self> {
        Self::JUDGED.into_iter().find(|refusal| refusal.reason() == reason && refusal.unit() == unit)
    }

    /// The reason in the ledger.
    pub const fn reason(self) -> &'static str {
        match self {
            Self::NoSound | Self::NoSoundFile => "no sound",
            Self::Quiet => "quiet",
            Self::NoSpeech => "no speech",
            Self::OtherVoice => "voice of another",
            Self::Still => "still",
            Self::NoPerson => "no person",
            Self::Small => "too small",
            Self::Face => "face",
            Self::Turned | Self::NoseOff => "turned",
            Self::Arms => "arms",
            Self::OtherHand => "other hand",
            Self::HandGap | Self::HandShare => "hands",
            Self::Jump => "jump",
            Self::Cut => "cut",
            Self::Identity => "other person",
            Self::TooShort | Self::FewFrames => "too short",
            Self::Crowd => "crowd",
            Self::Bones => "bones",
            Self::Open => "open",
            Self::Duplicate => "duplicate",
            Self::Guard => "between splits",
            Self::Prediction => "prediction",
            Self::OutOfStep => "out of step",
            Self::NotImported => "not here",
        }
    }

    /// What `measured` and `threshold` are given in; empty: scores and shares, 0 to 1, and a correlation, -1 to 1.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Still
            | Self::OtherHand
            | Self::HandGap
            | Self::Cut
            | Self::Identity
            | Self::TooShort
            | Self::Duplicate
            | Self::Guard
            | Self::NoSoundFile
            | Self::OutOfStep
            | Self::NotImported => "s",
            Self::Bones => "bone lengths",
            Self::Open => "joints",
            Self::FewFrames => "frames",
            Self::Quiet => "dB",
            Self::Small => "px",
            Self::Turned => "neck-nose distances",
            Self::NoseOff => "half shoulder widths",
            Self::Jump => "shoulder widths",
            Self::NoSound
            | Self::NoSpeech
            | Self::OtherVoice
            | Self::NoPerson
            | Self::Face
            | Self::Arms
            | Self::HandShare
            | Self::Crowd
            | Self::Prediction => "",
        }
    }

    /// What the reason means, for a legend.
    pub const fn heading(self) -> &'static str {
        match self {
            Self::NoSound => "no sound track, or it has ended",
            Self::Quiet => "the sound is too quiet for speech",
            Self::NoSpeech => "the sound is not speech",
            Self::OtherVoice => "the voice is not that of the person seen",
            Self::Still => "the picture stands still",
            Self::NoPerson => "nobody is seen",
            Self::Small => "the speaker is too small in the picture",
            Self::Face => "the face is not visible",
            Self::Turned | Self::NoseOff => "the speaker is turned sideways or away",
            Self::Arms => "shoulders or elbows are not visible",
            Self::OtherHand => "one hand is found in the place of the other",
            Self::HandGap | Self::HandShare => "a hand is not visible for too long",
            Self::Jump => "the speaker jumps from frame to frame",
            Self::Cut => "a cut leaves too short an interval",
            Self::Identity => "a change of person leaves too short an interval",
            Self::TooShort => "too short between other refusals",
            Self::Crowd => "too many people are in view",
            Self::Bones => "a lifted bone is far off its length",
            Self::Open => "joints stay unseen for too long",
            Self::Duplicate => "another video has it already",
            Self::Guard => "left out between two splits",
            Self::NoSoundFile => "no sound was found, or it has ended",
            Self::Prediction => "a model predicted it",
            Self::OutOfStep => "sound and motion differ in length",
            Self::FewFrames => "sound and motion have too few frames in common",
            Self::NotImported => "the imported shards do not hold it",
        }
    }

    /// The sentence, with what was measured and the threshold.
    pub fn message(self, measured: f64, threshold: f64) -> String {
        let (m, t) = (measured, threshold);
        match self {
            Self::NoSound => "no sound: there is no track, or it has ended".to_owned(),
            Self::Quiet => format!("too quiet: the sound is at {m:.0} dB, {t:.0} dB is needed"),
            Self::NoSpeech => {
                format!("no speech: {:.0} % of the sound is speech, at least {:.0} % are needed", 100.0 * m, 100.0 * t)
            }
            Self::OtherVoice => {
                format!("voice of another: the mouth follows the sound with {m:.2}, at least {t:.2} is needed")
            }
            Self::Still => format!("the picture stands still for {m:.1} s, {t:.1} s are allowed"),
            Self::NoPerson => format!("no person: face and arms score {m:.2} at best, {t:.2} is needed"),
            Self::Small => format!("too small: {m:.0} px between the shoulders, {t:.0} px are needed"),
            Self::Face => format!("the face is not visible: nose and eyes score {m:.2}, {t:.2} is needed"),
            Self::Turned => {
                format!("turned away: the shoulders are {m:.2} neck-nose distances wide, {t:.2} are needed")
            }
            Self::NoseOff => {
                format!("turned sideways: the nose is {m:.2} half shoulder widths beside the neck, {t:.2} are allowed")
            }
            Self::Arms => format!("the arms are not visible: shoulders and elbows score {m:.2}, {t:.2} is needed"),
            Self::OtherHand => {
                format!(
                    "a hand is not visible for {m:.1} s, where the other one is found in its place, {t:.1} s are allowed"
                )
            }
            Self::HandGap => format!("a hand is not visible for {m:.1} s, {t:.1} s are allowed"),
            Self::Jump => format!("the neck jumps by {m:.2} shoulder widths in a frame, {t:.2} are allowed"),
            Self::Cut => format!("a cut of the film leaves {m:.2} s of the {t:.2} s that an interval needs"),
            Self::Identity => format!("a change of person leaves {m:.2} s of the {t:.2} s that an interval needs"),
            Self::TooShort => format!("too short: {m:.2} s of the {t:.2} s that an interval needs"),
            Self::HandShare => format!("a hand is seen in only {m:.2} of the frames, {t:.2} is needed"),
            Self::Crowd => format!("too many people in {m:.2} of the frames, {t:.2} is allowed"),
            Self::Bones => format!("a bone was lifted {m:.2} off its length in the video, {t:.2} is allowed"),
            Self::Open => format!("{m:.0} of the joints are not seen for longer than can be filled"),
            Self::Duplicate => format!("{m:.1} s are in another video"),
            Self::Guard => format!("{m:.1} s are left out: two splits are at least {t:.1} s apart"),
            Self::NoSoundFile => "the sound ends here".to_owned(),
            Self::Prediction => "it is what a model predicted, not how a person moved".to_owned(),
            Self::OutOfStep => format!("sound and motion are {m:.3} s apart, at most {t} s are believed"),
            Self::FewFrames => format!("{m} frames have motion and sound, at least {t} are needed"),
            Self::NotImported => "the shards that were imported do not hold it".to_owned(),
        }
    }
}

/// Why a frame, or a run of frames, is refused: the reason, what was measured, and what it had to reach or stay below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameRefusal {
    pub refusal: Refusal,
    pub measured: f64,
    pub threshold: f64,
}

impl FrameRefusal {
    pub const fn new(refusal: Refusal, measured: f64, threshold: f64) -> Self {
        Self { refusal, measured, threshold }
    }

    /// The mean of what was measured over a run of frames.
    pub fn mean_measured(run: &[Option<Self>]) -> f64 {
        run.iter().flatten().map(|refused| refused.measured).sum::<f64>() / run.len().max(1) as f64
    }
}
