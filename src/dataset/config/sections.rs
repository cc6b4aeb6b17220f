//! The sections of `pipeline.toml` with their defaults. What each key means, its unit and its reason stand in the
//! top level `pipeline.toml`; here are the types.

use super::choices::{FollowRule, SpeechRule, SplitUnit};
use super::config_path::ConfigPath;
use super::gan::GanConfig;
use super::seq2seq::Seq2seqConfig;
use orator_base::types::time::FrameRate;
use serde::{Deserialize, Serialize};

/// Everything a run needs to know. Paths are absolute once resolved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[derive(Default)]
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
#[serde(deny_unknown_fields)]
pub struct SpeakerConfig {
    pub name: String,
    /// Paths or glob patterns.
    #[serde(default)]
    pub videos: Vec<String>,
    /// Keypoints that other programs found, named as videos are.
    #[serde(default)]
    pub keypoints: Vec<String>,
    /// Sounds of the keypoints, found by their names.
    #[serde(default)]
    pub audio: Vec<String>,
    /// Transcripts of the videos, found by their names.
    #[serde(default)]
    pub transcripts: Vec<String>,
    /// Frames a second of the keypoints; 0: their files say.
    #[serde(default)]
    pub fps: f64,
    /// Width and height of the keypoints' picture in px, `1280x720`; empty: their files say.
    #[serde(default)]
    pub size: String,
    /// A picture that shows the speaker as its largest person; empty: none.
    #[serde(default)]
    pub reference: ConfigPath,
    /// Videos to leave out, though `videos` names them: paths, file names or patterns. So are the next four.
    #[serde(default)]
    pub exclude: Vec<String>,
    /// Videos that show the speaker as a mirror does.
    #[serde(default)]
    pub mirrored: Vec<String>,
    /// Videos whose split is not left to chance.
    #[serde(default)]
    pub train: Vec<String>,
    #[serde(default)]
    pub validation: Vec<String>,
    #[serde(default)]
    pub test: Vec<String>,
    /// Said by the user: all videos show one person, so that they are not compared.
    #[serde(default)]
    pub same_person: bool,
    /// For the dataset's card: the licence's identifier, how the speaker agreed, where the videos come from.
    #[serde(default)]
    pub licence: String,
    #[serde(default)]
    pub consent: String,
    #[serde(default)]
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
    pub dir: ConfigPath,
    /// Units worked on side by side; 0: one a core.
    pub jobs: usize,
    /// Read videos in restricted processes of their own.
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
    pub dir: ConfigPath,
    /// Path of `libonnxruntime.so`; empty: searched for (see `orator doctor`).
    pub onnxruntime: ConfigPath,
}

impl Default for ModelsConfig {
    fn default() -> Self {
        Self { dir: "models".into(), onnxruntime: ConfigPath::default() }
    }
}

/// `[extract]`: the dataset's clock.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ExtractConfig {
    /// Dataset frames a second.
    pub fps: u32,
    /// Which of several sound tracks, from 1; 0: the first that the file marks as its default, else the first.
    pub audio_track: usize,
    /// Shift the sound of a video by the offset that the lips show, where it is sure.
    pub fix_offset: bool,
    /// Write every dataset frame as PNG as well.
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
    /// Palm detector, asked when a hand is lost; empty: none.
    pub palm: String,
    /// Face model, which sees how far the mouth is open; empty, or `auto` where it is not there: none.
    pub face: String,
    /// Whom of several people to follow.
    pub follow: FollowRule,
    /// The person detector looks at every n-th frame of a shot.
    pub person_every: usize,
    /// The palm detector looks at every n-th frame while a hand is missing; more rarely while it finds none.
    pub palm_every: usize,
    /// Weight of a new person box against the followed one, 0..1.
    pub person_follow: f64,
    /// A hand whose score is below this is not there.
    pub hand_score: f64,
    /// An arm joint whose score is below this does not guide a hand search.
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
    /// Shot score, 0..1, from which a frame begins a new shot.
    pub shot_threshold: f64,
    /// Shortest interval, in frames (a window of the paper: 64).
    pub min_frames: usize,
    /// A face or arm joint is visible from this score on, 0..1.
    pub joint_score: f64,
    /// Longest gap of an arm or the face that is filled and masked, seconds; at most what lift fills, 1.
    pub max_body_gap_secs: f64,
    /// Longest gap of one hand that is masked, seconds; at most what lift fills, 1.
    pub max_hand_gap_secs: f64,
    /// Least share of an interval's frames in which each hand is seen, 0..1.
    pub min_hand_share: f64,
    /// Farthest that the wrists of hands that rest on each other move within a second, in shoulder widths; 0: a hand at
    /// rest that is not seen is a missing one.
    pub max_rest_move: f64,
    /// Least distance between the shoulders, pixels.
    pub min_shoulder_px: f64,
    /// Least loudness of the second around a frame, dB of full scale.
    pub min_sound_db: f64,
    /// What tells speech from other sound.
    pub speech: SpeechRule,
    /// Least share of speech in the 4 s around a frame, 0..1, as the speech model tells it.
    pub min_speech: f64,
    /// Least correlation of the mouth that is seen with the voice, in the 8 s around a frame, -1..1.
    pub min_lip_sync: f64,
    /// Longest stretch, quiet or without speech, that is a pause of speech, seconds.
    pub max_quiet_secs: f64,
    /// Least change of a moving picture from frame to frame, steps of 8-bit colour.
    pub min_change: f64,
    /// Longest stretch in which the picture may stand still, seconds; at most what lift fills, 1.
    pub max_still_secs: f64,
    /// Least width of the shoulders, in distances from neck to nose; from behind it is negative.
    pub min_facing: f64,
    /// Farthest the nose may be beside the neck, in half shoulder widths.
    pub max_nose_off: f64,
    /// People in view that are not too many.
    pub max_people: u32,
    /// Largest share of an interval's frames with more people, 0..1.
    pub max_crowd_share: f64,
    /// Largest step of the neck between two frames, in shoulder widths.
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
    /// Weights of the body lifter (safetensors); empty: the built-in ones.
    pub body_weights: ConfigPath,
    /// Weights of the hand lifter (safetensors); empty: the built-in ones.
    pub hand_weights: ConfigPath,
    /// Width of the Gaussian that smooths arms, in frames at 15 fps; 0: none.
    pub smooth_arms: f64,
    /// Width of the Gaussian that smooths hands, in frames at 15 fps; 0: none.
    pub smooth_hands: f64,
    /// Turn each interval as if the camera had been level and the speaker upright.
    pub level: bool,
    /// Farthest a lifted bone may be from its length in the video, as a share of it.
    pub max_bone_change: f64,
}

impl Default for LiftConfig {
    fn default() -> Self {
        let none = ConfigPath::default();
        let (smooth_arms, smooth_hands, level, max_bone_change) = (0.8, 1.5, false, 0.4);
        Self { body_weights: none.clone(), hand_weights: none, smooth_arms, smooth_hands, level, max_bone_change }
    }
}

/// `[dataset]`: the dataset on disk.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DatasetConfig {
    /// A shard is closed when it holds this many megabytes.
    pub max_mb: u32,
    /// What is put into a split: whole videos, or blocks of their time.
    pub split_by: SplitUnit,
    /// Shares of the seconds for validation and test, 0..1; the rest trains.
    pub validation: f64,
    pub test: f64,
    /// Seconds of equal sound from which two videos belong to one split; 0: sound is not compared.
    pub duplicate_secs: f64,
    /// Write angles of head and trunk beside the joints.
    pub posture: bool,
}

impl Default for DatasetConfig {
    fn default() -> Self {
        let (validation, test, duplicate_secs, posture) = (0.15, 0.15, 5.0, false);
        Self { max_mb: 256, split_by: SplitUnit::Auto, validation, test, duplicate_secs, posture }
    }
}
