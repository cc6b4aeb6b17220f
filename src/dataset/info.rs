//! Description file `info.json`: the meaning of all arrays and fields, for readers without this program.

use super::config::SplitUnit;
use super::index::{self, ShardRef};
use super::sample::{N_KEYPOINTS, OPTIONAL_EXTENSIONS, WORDS_EXTENSION};
use super::split::{Split, SplitBy, SplitRule, TimeBlock};
use orator_base::types::skeleton::{self, N_JOINTS, Side};
use orator_base::types::time::FrameRate;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Contents of `info.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DatasetInfo {
    pub schema: u32,
    pub speaker: String,
    /// Program that wrote the dataset, with its version.
    pub tool: String,
    pub fps: FrameRate,
    /// Audio samples per second.
    pub sound_rate: u32,
    /// Members of a sample by extension.
    pub members: BTreeMap<String, Member>,
    /// Coordinate axes of `pose3d.npy`.
    pub axes: JointAxes,
    pub joints: Vec<SkeletonJoint>,
    /// Length of the bone from joint `n + 1` to its parent, metres: the median over the videos. Within a video, bones
    /// have the constant lengths in `videos/<name>.json`.
    pub bone_lengths_metres: Vec<f64>,
    /// Names of the 59 keypoints of `pose2d.npy`.
    pub keypoints: Vec<String>,
    /// Models that were applied to the videos.
    pub models: Vec<ModelUsed>,
    /// Licence identifier; empty: not stated.
    pub licence: String,
    /// Form of the speaker's consent; empty: not stated.
    pub consent: String,
    /// Origin of the videos; empty: not stated.
    pub source: String,
    /// Further notes for readers, a sentence each.
    pub notes: Vec<String>,
    /// Whether the sound was replaced by silence (`orator import --no-audio`).
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub no_sound: bool,
    /// How the splits were made; `None`: the dataset was written by an earlier version.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub split_rule: Option<SplitRule>,
    pub splits: BTreeMap<String, SplitInfo>,
    /// Videos sorted by name, including those without samples.
    pub videos: Vec<DatasetVideo>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DatasetVideo {
    pub name: String,
    pub file: String,
    /// BLAKE3 of the file.
    pub content: String,
    /// Split; `None`: no samples, or samples in several splits (`blocks`).
    pub split: Option<Split>,
    pub split_by: SplitBy,
    /// Time blocks with their splits; empty for a video that is in one split.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub blocks: Vec<TimeBlock>,
    pub samples: usize,
    pub secs: f64,
}

/// Description of an array or file of a sample.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Member {
    pub shape: String,
    pub element: String,
    pub meaning: String,
}

/// Axis directions, unit and origin of joint coordinates.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct JointAxes {
    pub x: String,
    pub y: String,
    pub z: String,
    pub unit: String,
    pub origin: String,
}

/// Joint of the skeleton; `parent` is an index into the list of joints.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SkeletonJoint {
    pub name: String,
    pub parent: Option<usize>,
    pub side: String,
}

/// Model with its role (`body`, `hand`, ...), its id in the manifest and the hash of its file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModelUsed {
    pub role: String,
    pub id: String,
    pub sha256: String,
    /// Licence of the weights; empty in older datasets.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub licence: String,
}

impl ModelUsed {
    /// Role of the speech recogniser.
    pub const WORDS: &str = "words";
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SplitInfo {
    pub shards: Vec<ShardRef>,
    pub videos: Vec<String>,
    #[serde(deserialize_with = "index::count")]
    pub samples: usize,
    #[serde(deserialize_with = "index::count")]
    pub frames: usize,
    pub secs: f64,
}

/// Description of a dataset without its videos.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    pub speaker: String,
    pub tool: String,
    pub fps: FrameRate,
    pub models: Vec<ModelUsed>,
    pub licence: String,
    pub consent: String,
    pub source: String,
    pub notes: Vec<String>,
    pub no_sound: bool,
    pub split_rule: Option<SplitRule>,
}

impl About {
    /// Description with the given speaker and frame rate; all other fields are empty.
    pub fn new(speaker: &str, fps: FrameRate) -> Self {
        let (speaker, tool) = (speaker.to_owned(), concat!("orator ", env!("CARGO_PKG_VERSION")).to_owned());
        let (models, notes, no_sound, split_rule) = (Vec::new(), Vec::new(), false, None);
        let [licence, consent, source] = [const { String::new() }; 3];
        Self { speaker, tool, fps, models, licence, consent, source, notes, no_sound, split_rule }
    }
}

impl DatasetInfo {
    /// What to change so that `orator run` also fills an empty split.
    pub fn empty_split_fix(&self) -> &'static str {
        let is_by_time = self.split_rule.as_ref().is_some_and(|rule| rule.unit == SplitUnit::Time);
        let are_named = self.videos.iter().any(|video| video.samples > 0 && video.split_by == SplitBy::Name);
        match (is_by_time, are_named) {
            (true, false) => {
                "too little footage was accepted to divide it (about a minute is enough for three splits); add videos"
            }
            (true, true) => {
                "videos with a split named under [[speaker]] are not divided: add videos, or remove the names and \
                 splits/SPEAKER.json in the work folder"
            }
            (false, true) => {
                "add videos, or remove the splits named under [[speaker]] and set `split_by = \"time\"` under [dataset]"
            }
            (false, false) => "add videos, or set `split_by = \"time\"` under [dataset] to divide all videos again",
        }
    }

    /// Contents for a dataset; `bones` are the speaker's 48 bone lengths, metres.
    pub fn new(about: &About, bones: &[f32], splits: BTreeMap<Split, SplitInfo>, videos: Vec<DatasetVideo>) -> Self {
        let About { speaker, tool, fps, models, licence, consent, source, notes, no_sound, split_rule } = about.clone();
        Self {
            schema: super::SCHEMA,
            speaker,
            tool,
            fps,
            sound_rate: orator_base::types::sound::SAMPLE_RATE,
            members: members(),
            axes: JointAxes {
                x: "image right".into(),
                y: "down".into(),
                z: "away from the camera".into(),
                unit: "metres".into(),
                origin: "the neck, in every frame".into(),
            },
            joints: (0..N_JOINTS).map(joint).collect(),
            bone_lengths_metres: bones.iter().map(|&length| f64::from(length)).collect(),
            keypoints: keypoint_names(),
            models,
            licence,
            consent,
            source,
            notes,
            no_sound,
            split_rule,
            splits: splits.into_iter().map(|(split, info)| (split.name().to_owned(), info)).collect(),
            videos,
        }
    }

    /// Description without the videos.
    pub fn about(&self) -> About {
        let DatasetInfo { speaker, tool, fps, models, licence, consent, source, notes, no_sound, split_rule, .. } =
            self.clone();
        About { speaker, tool, fps, models, licence, consent, source, notes, no_sound, split_rule }
    }

    /// Adds the description of the member `words.json`.
    pub fn with_words(mut self) -> Self {
        let meaning = "the words said, each with start_secs and end_secs from the first frame's beginning, the source of \
                       these times (given, shared, aligned, interpolated) and confidence 0..1 or null";
        let member = Member { shape: "N words".into(), element: String::new(), meaning: meaning.into() };
        self.members.insert(WORDS_EXTENSION.to_owned(), member);
        self
    }

    /// Adds the descriptions of the members `head.npy` and `trunk.npy`.
    pub fn with_posture(mut self) -> Self {
        let [_, head, trunk, _] = OPTIONAL_EXTENSIONS;
        let angles = "yaw to the person's left, pitch downwards, roll towards the right shoulder, radians, in the axes of the joints; \
                      NaN where an angle was not seen, which is the mask";
        for (name, of) in
            [(head, "the head, 0 where it looks as in the clip's median"), (trunk, "the trunk, hips to neck")]
        {
            let meaning = format!("{of}: {angles}");
            self.members.insert(name.to_owned(), Member { shape: "T, 3".into(), element: "float32".into(), meaning });
        }
        self
    }

    /// Adds the description of the member `interlocutor.wav`.
    pub fn with_interlocutor(mut self) -> Self {
        let sound = self.members["wav"].clone();
        let meaning = "the person whom the speaker talks to, like `wav`".to_owned();
        self.members.insert(OPTIONAL_EXTENSIONS[3].to_owned(), Member { meaning, ..sound });
        self
    }

    pub fn shards(&self) -> impl Iterator<Item = &ShardRef> {
        self.splits.values().flat_map(|split| &split.shards)
    }
}

fn members() -> BTreeMap<String, Member> {
    let rows = [
        (
            "pose3d.npy",
            "T, 49, 3",
            "float32",
            "joints, see `joints` and `axes`; NaN where missing; bones constant over a video",
        ),
        ("pose2d.npy", "T, 59, 3", "float32", "keypoints, see `keypoints`: x px, y px, score 0..1; 0 is missing"),
        ("mask.npy", "T, 49", "bool", "whether the joint was seen; false where it is missing or was filled in"),
        (
            "wav",
            "T seconds times the sound rate",
            "int16",
            "mono sound from the first frame's beginning to the last's end",
        ),
        ("json", "", "", "where the interval comes from"),
    ];
    let member = |(name, shape, element, meaning): (&str, &str, &str, &str)| {
        (name.to_owned(), Member { shape: shape.into(), element: element.into(), meaning: meaning.into() })
    };
    rows.map(member).into()
}

fn joint(joint: usize) -> SkeletonJoint {
    let side = match skeleton::side(joint) {
        Side::Centre => "centre",
        Side::Left => "left",
        Side::Right => "right",
    };
    SkeletonJoint { name: skeleton::name(joint), parent: skeleton::parent(joint), side: side.to_owned() }
}

/// Names of the 59 keypoints, in their order.
pub fn keypoint_names() -> Vec<String> {
    let paired = ["Eye", "Ear", "Shoulder", "Elbow", "Wrist", "Hip", "Knee", "Ankle"];
    let body = paired.iter().flat_map(|name| [format!("L{name}"), format!("R{name}")]);
    // Hand keypoints are in joint order: the wrist, then the fingers from base to tip.
    let hand = |root: usize| (root..root + skeleton::N_HAND_JOINTS).map(skeleton::name);
    let mut names = Vec::with_capacity(N_KEYPOINTS);
    names.push("Nose".to_owned());
    names.extend(body.chain(hand(skeleton::L_HAND)).chain(hand(skeleton::R_HAND)));
    names
}
