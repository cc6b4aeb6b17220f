//! The sections of `pipeline.toml` with their types and defaults. `pipeline.toml` and the guide (`configuration`) document
//! meaning and unit of each key.

use super::choices::{FollowRule, SpeechRule, SplitUnit};
use super::gan::GanConfig;
use super::seq2seq::Seq2seqConfig;
use orator_base::types::time::FrameRate;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Keys that are paths; an empty one is none.
pub(super) const PATHS: [&str; 6] =
    ["work.dir", "models.dir", "models.onnxruntime", "lift.body_weights", "lift.hand_weights", "speaker.reference"];

/// Everything a run needs to know. Paths are absolute once resolved.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    pub work: WorkConfig,
    pub models: ModelsConfig,
    pub extract: ExtractConfig,
    pub pose2d: Pose2dConfig,
    pub segment: SegmentConfig,
    pub lift: LiftConfig,
    pub dataset: DatasetConfig,
    pub gan: GanConfig,
    pub seq2seq: Seq2seqConfig,
    pub speaker: Vec<SpeakerConfig>,
}

/// `[[speaker]]`: one person, with the videos that show them, or keypoints of such videos.
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
    /// `size` as width and height; `None` where it is empty or no size.
    pub fn image_size(&self) -> Option<[u32; 2]> {
        image_size(&self.size)
    }
}

/// Width and height in px of `1280x720`; `None`: it is no size.
pub fn image_size(text: &str) -> Option<[u32; 2]> {
    let (width, height) = text.split_once('x')?;
    let px = |text: &str| text.trim().parse().ok().filter(|px| (1..=100_000).contains(px));
    Some([px(width)?, px(height)?])
}

/// `[work]`: where the stages write.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WorkConfig {
    pub dir: PathBuf,
    pub jobs: usize,
    pub sandbox: bool,
}

impl Default for WorkConfig {
    fn default() -> Self {
        Self { dir: "work".into(), jobs: 0, sandbox: true }
    }
}

/// `[models]`: where the ONNX models and the ONNX Runtime library are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ModelsConfig {
    pub dir: PathBuf,
    pub onnxruntime: PathBuf,
}

impl Default for ModelsConfig {
    fn default() -> Self {
        Self { dir: "models".into(), onnxruntime: PathBuf::new() }
    }
}

/// `[extract]`: the dataset's clock.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ExtractConfig {
    pub fps: u32,
    pub audio_track: usize,
    pub fix_offset: bool,
    pub keep_frames: bool,
}

impl ExtractConfig {
    /// The dataset rate.
    pub fn rate(&self) -> FrameRate {
        FrameRate::new(self.fps, 1)
    }
}

impl Default for ExtractConfig {
    fn default() -> Self {
        Self { fps: 15, audio_track: 0, fix_offset: false, keep_frames: false }
    }
}

/// `[pose2d]`: which models look at a frame (ids of `models/manifest.toml`; `auto`: the best that is there), and the
/// tracking of the one speaker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pose2dConfig {
    pub person: String,
    pub body: String,
    pub hand: String,
    pub palm: String,
    pub face: String,
    pub follow: FollowRule,
    pub person_every: usize,
    pub palm_every: usize,
    pub person_follow: f64,
    pub hand_score: f64,
    pub joint_score: f64,
}

impl Default for Pose2dConfig {
    fn default() -> Self {
        Self {
            person: "auto".into(),
            body: "auto".into(),
            hand: "auto".into(),
            palm: "auto".into(),
            face: "auto".into(),
            follow: FollowRule::Largest,
            person_every: 5,
            palm_every: 5,
            person_follow: 0.3,
            hand_score: 0.5,
            joint_score: 0.3,
        }
    }
}

/// `[segment]`: which stretches are worth keeping.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentConfig {
    pub shot_threshold: f64,
    pub min_frames: usize,
    pub joint_score: f64,
    pub max_body_gap_secs: f64,
    pub max_hand_gap_secs: f64,
    pub min_hand_share: f64,
    pub max_rest_move: f64,
    pub min_shoulder_px: f64,
    pub min_sound_db: f64,
    pub speech: SpeechRule,
    pub min_speech: f64,
    pub min_lip_sync: f64,
    pub max_quiet_secs: f64,
    pub min_change: f64,
    pub max_still_secs: f64,
    pub min_facing: f64,
    pub max_nose_off: f64,
    pub max_people: u32,
    pub max_crowd_share: f64,
    pub max_jump: f64,
}

impl Default for SegmentConfig {
    fn default() -> Self {
        Self {
            shot_threshold: 0.2,
            min_frames: 64,
            joint_score: 0.3,
            max_body_gap_secs: 0.34,
            max_hand_gap_secs: 1.0,
            min_hand_share: 0.5,
            max_rest_move: 0.1,
            min_shoulder_px: 40.0,
            min_sound_db: -50.0,
            speech: SpeechRule::Auto,
            min_speech: 0.4,
            min_lip_sync: 0.1,
            max_quiet_secs: 3.0,
            min_change: 0.03,
            max_still_secs: 0.5,
            min_facing: 1.0,
            max_nose_off: 1.0,
            max_people: 5,
            max_crowd_share: 0.3,
            max_jump: 0.5,
        }
    }
}

/// `[lift]`: 2D keypoints to 3D joints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LiftConfig {
    pub body_weights: PathBuf,
    pub hand_weights: PathBuf,
    pub smooth_arms: f64,
    pub smooth_hands: f64,
    pub level: bool,
    pub max_bone_change: f64,
}

impl Default for LiftConfig {
    fn default() -> Self {
        let none = PathBuf::new();
        let (smooth_arms, smooth_hands, level, max_bone_change) = (0.8, 1.5, false, 0.4);
        Self { body_weights: none.clone(), hand_weights: none, smooth_arms, smooth_hands, level, max_bone_change }
    }
}

/// `[dataset]`: the dataset on disk.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DatasetConfig {
    pub max_mb: u32,
    pub split_by: SplitUnit,
    pub validation: f64,
    pub test: f64,
    pub duplicate_secs: f64,
    pub posture: bool,
}

impl Default for DatasetConfig {
    fn default() -> Self {
        let (validation, test, duplicate_secs, posture) = (0.15, 0.15, 5.0, false);
        Self { max_mb: 256, split_by: SplitUnit::Auto, validation, test, duplicate_secs, posture }
    }
}
