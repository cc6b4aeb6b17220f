//! Reasons for rejecting seconds of a video: each has a word in the ledger, a label, the unit of its measured value, a
//! heading and a sentence for the user.

/// Defines the reasons: the measured quantity as documentation, then name, word in the ledger, label, unit and heading.
macro_rules! rejections {
    ($($(#[$doc:meta])* $name:ident: $reason:literal, $label:literal, $unit:literal, $heading:literal;)*) => {
        /// A reason for rejecting frames. The reasons in `JUDGED` come first, in the order in which they are checked:
        /// the first one that applies is recorded.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Rejection {
            $($(#[$doc])* $name,)*
        }

        impl Rejection {
            const ALL: &[Self] = &[$(Self::$name),*];

            const fn texts(self) -> [&'static str; 4] {
                match self {
                    $(Self::$name => [$reason, $label, $unit, $heading],)*
                }
            }
        }
    };
}

rejections! {
    /// Fraction of the frames with sound.
    NoSound: "no sound", "no audio", "", "no audio track, or it has ended";
    /// Loudness in dB of full scale.
    Quiet: "quiet", "too quiet", "dB", "the audio is too quiet for speech";
    /// Fraction of the sound that is speech.
    NoSpeech: "no speech", "no speech", "", "the audio is not speech";
    /// Correlation between the visible mouth and the voice.
    OffScreenSpeaker: "voice of another", "off-screen speaker", "", "the voice belongs to an off-screen speaker";
    /// Seconds for which the picture is static.
    Static: "still", "static picture", "s", "the picture is static";
    /// Highest score of face and arms.
    NoPerson: "no person", "no person", "", "no person is detected";
    /// Distance between the shoulders in px.
    Small: "too small", "person too small", "px", "the speaker is too small in the picture";
    /// Score of nose and eyes.
    Face: "face", "face not visible", "", "the face is not visible";
    /// Width of the shoulders in neck-nose distances.
    Turned: "turned", "turned away", "neck-nose distances", "the speaker is turned sideways or away";
    /// Horizontal distance from nose to neck in half shoulder widths.
    NoseOff: "turned", "turned away", "half shoulder widths", "the speaker is turned sideways or away";
    /// Lowest score of shoulders and elbows.
    Arms: "arms", "arms not visible", "", "shoulders or elbows are not visible";
    /// Seconds for which a hand is missing because the other hand was detected at its position.
    OtherHand: "other hand", "duplicate hand", "s", "one hand is detected at the position of the other";
    /// Seconds for which a hand is missing.
    HandGap: "hands", "hand not visible", "s", "a hand is not visible for too long";
    /// Shoulder widths that the neck moves from one frame to the next.
    Jump: "jump", "jump", "shoulder widths", "the speaker jumps from frame to frame";
    /// Seconds of an interval that remain beside a shot boundary.
    Cut: "cut", "close to a cut", "s", "the interval before or after a cut is too short";
    /// Seconds of an interval that remain beside a change of the tracked person.
    Identity: "other person", "change of person", "s", "the interval before or after a change of person is too short";
    /// Seconds of an interval that remain between other rejections.
    TooShort: "too short", "too short", "s", "too short between other rejected intervals";
    /// Fraction of the frames in which the less visible hand is visible.
    HandShare: "hands", "hand not visible", "", "a hand is not visible for too long";
    /// Fraction of the frames with too many persons.
    Crowd: "crowd", "too many persons", "", "too many persons are in view";
    /// Deviation of a lifted bone from its length in the video, as a fraction of that length.
    Bones: "bones", "bone length", "bone lengths", "a lifted bone deviates too much from its length";
    /// Number of joints that are not visible for longer than lifting interpolates.
    MissingJoints: "open", "missing joints", "joints", "joints are not visible for too long";
    /// Length in seconds of the range that a user rejected.
    ByHand: "rejected by hand", "by hand", "s", "a user rejected it (`decisions.toml`)";
    /// Seconds that are also in another video of the dataset.
    Duplicate: "duplicate", "duplicate", "s", "duplicate of another video";
    /// Seconds omitted between two splits of a video.
    SplitGap: "between splits", "between splits", "s", "omitted between two splits";
    /// An imported take without a sound file, or its frames after the end of the sound.
    NoSoundFile: "no sound", "no sound", "s", "no audio file was found, or the audio has ended";
    /// An imported take that was predicted by a model.
    Prediction: "prediction", "prediction", "", "predicted by a model";
    /// Difference in seconds between the lengths of sound and motion of an imported take.
    LengthMismatch: "out of step", "out of step", "s", "audio and motion differ in length";
    /// Number of frames of an imported take with both motion and sound.
    FewFrames: "too short", "too short", "frames", "audio and motion have too few frames in common";
    /// Seconds that the imported shards do not contain.
    NotImported: "not here", "not here", "s", "not contained in the imported shards";
}

impl Rejection {
    /// Reasons by which `segment` and `lift` judge frames.
    pub const JUDGED: [Self; 22] = match Self::ALL.first_chunk() {
        Some(judged) => *judged,
        None => panic!("fewer reasons than judged ones"),
    };

    /// Finds the judged reason of a ledger entry with this word and unit.
    pub fn find(reason: &str, unit: &str) -> Option<Self> {
        Self::JUDGED.into_iter().find(|rejection| rejection.reason() == reason && rejection.unit() == unit)
    }

    /// Machine-readable word in the ledger.
    pub const fn reason(self) -> &'static str {
        self.texts()[0]
    }

    /// Label of the ledger word `reason` for people who read it; an unknown word is its own label.
    pub fn label(reason: &str) -> &str {
        Self::ALL.iter().find(|known| known.reason() == reason).map_or(reason, |known| known.texts()[1])
    }

    /// Unit of measured value and threshold. Empty for scores and fractions (0 to 1) and for correlations (-1 to 1).
    pub const fn unit(self) -> &'static str {
        self.texts()[2]
    }

    /// Explanation of the reason, for a legend.
    pub const fn heading(self) -> &'static str {
        self.texts()[3]
    }

    /// Formats the sentence for the user from the measured value and the threshold, both in `unit()`.
    pub fn message(self, measured: f64, threshold: f64) -> String {
        let (m, t) = (measured, threshold);
        match self {
            Self::NoSound => "no sound: there is no track, or it has ended".to_owned(),
            Self::Quiet => format!("too quiet: the sound is at {m:.0} dB, {t:.0} dB is needed"),
            Self::NoSpeech => {
                format!("no speech: {:.0} % of the sound is speech, at least {:.0} % are needed", 100.0 * m, 100.0 * t)
            }
            Self::OffScreenSpeaker => {
                format!("voice of another: it is the visible mouth's with probability {m:.2}, {t:.2} is needed")
            }
            Self::Static => format!("the picture stands still for {m:.1} s, {t:.1} s are allowed"),
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
            Self::MissingJoints => format!("{m:.0} of the joints are not seen for longer than can be filled"),
            Self::ByHand => "rejected by hand".to_owned(),
            Self::Duplicate => format!("{m:.1} s are in another video"),
            Self::SplitGap => format!("{m:.1} s are left out: two splits are at least {t:.1} s apart"),
            Self::NoSoundFile => "the sound ends here".to_owned(),
            Self::Prediction => "it is what a model predicted, not how a person moved".to_owned(),
            Self::LengthMismatch => format!("sound and motion are {m:.3} s apart, at most {t} s are believed"),
            Self::FewFrames => format!("{m} frames have motion and sound, at least {t} are needed"),
            Self::NotImported => "the shards that were imported do not hold it".to_owned(),
        }
    }
}

/// Why a frame or a run of frames is rejected: the reason, the measured value, and the limit that it violates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameRejection {
    pub rejection: Rejection,
    pub measured: f64,
    pub threshold: f64,
}

impl FrameRejection {
    pub const fn new(rejection: Rejection, measured: f64, threshold: f64) -> Self {
        Self { rejection, measured, threshold }
    }

    /// Returns the mean measured value over a run of frames.
    pub fn mean_measured(run: &[Option<Self>]) -> f64 {
        run.iter().flatten().map(|rejected| rejected.measured).sum::<f64>() / run.len().max(1) as f64
    }
}
