//! Sections of `pipeline.toml` with the type, default and range of each key. `pipeline.toml` and the guide
//! (`configuration`) document the meaning and unit of each key.

use super::auto::AUTO;
use super::choices::{FollowRule, SpeechRule, SplitUnit};
use super::gan::GanConfig;
use super::seq2seq::Seq2seqConfig;
use orator_base::stage::artifacts::StageName;
use orator_base::types::device::DeviceChoice;
use orator_base::types::time::FrameRate;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Keys whose values are paths; an empty value means that no path is set.
pub(super) const PATHS: [&str; 6] =
    ["work.dir", "models.dir", "models.onnxruntime", "lift.body_weights", "lift.hand_weights", "speaker.reference"];

/// Published speech recognisers, of English only and of many languages.
pub(super) const ENGLISH_MODEL: &str = "whisper-tiny-en";
pub(super) const MULTILINGUAL_MODEL: &str = "whisper-base";

/// Numeric keys of a section with (minimum, maximum, unit).
pub(super) type KeyRanges = &'static [(&'static str, (f64, f64, &'static str))];

/// Defines a section of the configuration: each key with its type, default and, for a number, its range. Unknown keys
/// are rejected.
macro_rules! section {
    ($(#[$doc:meta])* $name:ident { $($(#[$alias:meta])* $key:ident: $type:ty = $default:expr $(=> $range:expr)?,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $($(#[$alias])* pub $key: $type,)*
        }

        impl $name {
            pub(super) const RANGES: $crate::config::sections::KeyRanges = &[$($((stringify!($key), $range),)?)*];
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($key: $default,)* }
            }
        }
    };
}

/// Defines the keys of a section in which the program may choose values. `N` and `C` are the types of the numbers and
/// counts that may be `"auto"`; `$number` and `$count` name the parameters of `with` that initialise them.
macro_rules! auto_section {
    (
        $(#[$doc:meta])* $name:ident |$number:ident, $count:ident| {
            $($(#[$alias:meta])* $key:ident: $type:ty = $default:expr $(=> $range:expr)?,)*
        }
    ) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(default)]
        pub struct $name<N, C> {
            $($(#[$alias])* pub $key: $type,)*
        }

        impl<N: Copy, C: Copy> $name<N, C> {
            pub(super) const RANGES: $crate::config::sections::KeyRanges = &[$($((stringify!($key), $range),)?)*];

            /// Defaults, with the given number and count for all settings that the program may choose.
            fn with($number: N, $count: C) -> Self {
                Self { $($key: $default,)* }
            }
        }
    };
}
pub(super) use auto_section;

/// All settings of a run. Paths are absolute once resolved.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    pub work: WorkConfig,
    pub models: ModelsConfig,
    pub extract: ExtractConfig,
    pub pose2d: Pose2dConfig,
    pub segment: SegmentConfig,
    pub lift: LiftConfig,
    pub transcribe: TranscribeConfig,
    pub dataset: DatasetConfig,
    pub gan: GanConfig,
    pub seq2seq: Seq2seqConfig,
    pub speaker: Vec<SpeakerConfig>,
}

impl Settings {
    /// Whether the words of any speaker are recognised.
    pub fn transcribes_any(&self) -> bool {
        self.speaker.iter().any(SpeakerConfig::transcribes)
    }

    /// Whether the words of this speaker are recognised.
    pub fn transcribes(&self, speaker: &str) -> bool {
        self.speaker.iter().any(|configured| configured.name == speaker && configured.transcribes())
    }

    /// Stages that process each video of this speaker, in order.
    pub fn stages_of(&self, speaker: &str) -> Vec<StageName> {
        let transcribes = self.transcribes(speaker);
        StageName::OF_VIDEOS.into_iter().filter(|stage| transcribes || *stage != StageName::Transcribe).collect()
    }
}

/// `[[speaker]]`: one person, with videos of them or keypoints of such videos.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SpeakerConfig {
    pub name: String,
    pub videos: Vec<String>,
    pub keypoints: Vec<String>,
    pub audio: Vec<String>,
    pub transcripts: Vec<String>,
    pub fps: f64,
    pub size: String,
    pub reference: PathBuf,
    pub exclude: Vec<String>,
    pub mirrored: Vec<String>,
    pub train: Vec<String>,
    pub validation: Vec<String>,
    pub test: Vec<String>,
    pub same_person: bool,
    pub licence: String,
    pub consent: String,
    pub source: String,
}

impl SpeakerConfig {
    /// Whether `transcripts = "auto"`: the words are recognised by the stage `transcribe`.
    pub fn transcribes(&self) -> bool {
        self.transcripts == [AUTO]
    }

    /// Width and height in `size`, px; `None` if it is empty or invalid.
    pub fn image_size(&self) -> Option<[u32; 2]> {
        image_size(&self.size)
    }
}

/// Parses an image size such as `1280x720` into width and height, px, each 1 to 100,000; `None` if it is invalid.
pub fn image_size(text: &str) -> Option<[u32; 2]> {
    let (width, height) = text.split_once('x')?;
    let px = |text: &str| text.trim().parse().ok().filter(|px| (1..=100_000).contains(px));
    Some([px(width)?, px(height)?])
}

section! {
    /// `[work]`: where the stages write, and how this machine works.
    WorkConfig {
        dir: PathBuf = "work".into(),
        jobs: usize = 0,
        sandbox: bool = true,
        device: DeviceChoice = DeviceChoice::Auto,
    }
}

section! {
    /// `[models]`: where the ONNX models and the ONNX Runtime library are, and the processor of the image models.
    ModelsConfig {
        dir: PathBuf = "models".into(),
        onnxruntime: PathBuf = PathBuf::new(),
        provider: DeviceChoice = DeviceChoice::Cpu,
    }
}

section! {
    /// `[extract]`: the dataset's clock.
    ExtractConfig {
        fps: u32 = 15 => (1.0, 120.0, "frames per second"),
        audio_track: usize = 0 => (0.0, 100.0, ""),
        fix_offset: bool = false,
        keep_frames: bool = false,
    }
}

impl ExtractConfig {
    /// Frame rate of the dataset.
    pub fn rate(&self) -> FrameRate {
        FrameRate::new(self.fps, 1)
    }
}

section! {
    /// `[pose2d]`: which models look at a frame (ids of `models/manifest.toml`; `auto`: the best that is there), and
    /// the tracking of the one speaker.
    Pose2dConfig {
        person: String = "auto".into(),
        body: String = "auto".into(),
        hand: String = "auto".into(),
        palm: String = "auto".into(),
        face: String = "auto".into(),
        follow: FollowRule = FollowRule::Largest,
        person_every: usize = 5 => (1.0, 10_000.0, "frames"),
        palm_every: usize = 5 => (1.0, 10_000.0, "frames"),
        #[serde(alias = "person_follow")]
        box_smoothing: f64 = 0.3 => (0.0, 1.0, ""),
        hand_score: f64 = 0.5 => (0.0, 1.0, ""),
        joint_score: f64 = 0.3 => (0.0, 1.0, ""),
    }
}

section! {
    /// `[segment]`: which stretches are worth keeping.
    SegmentConfig {
        shot_threshold: f64 = 0.2 => (0.0, 1.0, ""),
        min_frames: usize = 64 => (1.0, 1e6, "frames"),
        joint_score: f64 = 0.3 => (0.0, 1.0, ""),
        max_body_gap_secs: f64 = 0.34 => (0.0, 1.0, "seconds, the longest gap that lift fills"),
        max_hand_gap_secs: f64 = 1.0 => (0.0, 1.0, "seconds, the longest gap that lift fills"),
        min_hand_share: f64 = 0.5 => (0.0, 1.0, ""),
        max_rest_move: f64 = 0.1 => (0.0, 1.0, "shoulder widths"),
        min_shoulder_px: f64 = 40.0 => (1.0, 1e5, "pixels"),
        min_sound_db: f64 = -50.0 => (-120.0, 0.0, "dBFS"),
        speech: SpeechRule = SpeechRule::Auto,
        min_speech: f64 = 0.4 => (0.0, 1.0, ""),
        min_own_voice: f64 = 0.5 => (0.0, 1.0, ""),
        max_quiet_secs: f64 = 3.0 => (0.0, 60.0, "seconds"),
        min_change: f64 = 0.03 => (0.0, 255.0, "levels of 8-bit colour"),
        #[serde(alias = "max_still_secs")]
        max_static_secs: f64 = 0.5 => (0.0, 1.0, "seconds, the longest gap that lift fills"),
        min_facing: f64 = 0.5 => (-10.0, 10.0, "neck-nose distances"),
        max_nose_off: f64 = 3.0 => (0.0, 10.0, "half shoulder widths"),
        #[serde(alias = "max_people")]
        max_persons: u32 = 5 => (1.0, 255.0, "persons"),
        max_crowd_share: f64 = 0.3 => (0.0, 1.0, ""),
        max_jump: f64 = 0.5 => (0.01, 100.0, "shoulder widths"),
    }
}

section! {
    /// `[lift]`: 2D keypoints to 3D joints.
    LiftConfig {
        body_weights: PathBuf = PathBuf::new(),
        hand_weights: PathBuf = PathBuf::new(),
        smooth_arms: f64 = 0.8 => (0.0, 30.0, "frames"),
        smooth_hands: f64 = 1.5 => (0.0, 30.0, "frames"),
        level: bool = false,
        max_bone_change: f64 = 0.4 => (0.01, 100.0, "bone lengths"),
    }
}

section! {
    /// `[transcribe]`: recognition of the words of speakers with `transcripts = "auto"`.
    TranscribeConfig {
        model: String = AUTO.into(),
        language: String = String::new(),
    }
}

impl TranscribeConfig {
    /// Folder name of the model: the configured one, or the published one for the language.
    pub fn model_id(&self) -> &str {
        match (self.model.as_str(), self.language.as_str()) {
            (AUTO, "en") => ENGLISH_MODEL,
            (AUTO, _) => MULTILINGUAL_MODEL,
            (model, _) => model,
        }
    }

    /// Whether `orator models fetch` knows the model.
    pub fn is_published(&self) -> bool {
        [ENGLISH_MODEL, MULTILINGUAL_MODEL].contains(&self.model_id())
    }
}

section! {
    /// `[dataset]`: the dataset on disk.
    DatasetConfig {
        max_mb: u32 = 256 => (1.0, 100_000.0, "megabytes"),
        split_by: SplitUnit = SplitUnit::Auto,
        validation: f64 = 0.15 => (0.0, 0.9, ""),
        test: f64 = 0.15 => (0.0, 0.9, ""),
        duplicate_secs: f64 = 5.0 => (0.0, 3600.0, "seconds"),
        posture: bool = false,
    }
}
