//! `info.json`: what the numbers mean. Everything a reader needs who has never seen this project.

use super::index::ShardRef;
use super::sample::N_KEYPOINTS;
use super::split::Split;
use super::split::SplitBy;
use crate::types::skeleton;
use crate::types::skeleton::{N_JOINTS, Side};
use crate::types::time::FrameRate;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The whole file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DatasetInfo {
    pub schema: u32,
    pub speaker: String,
    /// The program that wrote it, with its version.
    pub tool: String,
    pub fps: FrameRate,
    /// Samples of sound a second.
    pub sound_rate: u32,
    /// The members of a sample, by extension.
    pub members: BTreeMap<String, Member>,
    /// What the coordinates of `pose3d.npy` are.
    pub axes: JointAxes,
    pub joints: Vec<SkeletonJoint>,
    /// Length of the bone from joint `n + 1` to its parent, metres: the median of the videos. In a video's samples the
    /// bones have the constant lengths of that video, see `videos/<name>.json`.
    pub bone_lengths_metres: Vec<f64>,
    /// The 59 points of `pose2d.npy`.
    pub keypoints: Vec<String>,
    /// The models that looked at the videos.
    pub models: Vec<ModelUsed>,
    /// Identifier of the licence, how the speaker agreed, where the videos come from; empty: not said.
    pub licence: String,
    pub consent: String,
    pub source: String,
    /// What else a reader must know, a sentence each.
    pub notes: Vec<String>,
    pub splits: BTreeMap<String, SplitInfo>,
    /// Sorted by name; those without a sample too.
    pub videos: Vec<DatasetVideo>,
}

/// A video of the dataset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DatasetVideo {
    pub name: String,
    pub file: String,
    /// BLAKE3 of the file.
    pub content: String,
    /// `None`: nothing of it was kept.
    pub split: Option<Split>,
    pub split_by: SplitBy,
    pub samples: usize,
    pub secs: f64,
}

/// An array or file of a sample.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Member {
    pub shape: String,
    pub element: String,
    pub meaning: String,
}

/// Directions and unit of joint coordinates.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct JointAxes {
    pub x: String,
    pub y: String,
    pub z: String,
    pub unit: String,
    pub origin: String,
}

/// A joint of the skeleton; `parent` is its number in the list.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SkeletonJoint {
    pub name: String,
    pub parent: Option<usize>,
    pub side: String,
}

/// A model by its role (`body`, `hand`, ...), its id in the manifest, and the hash of its file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModelUsed {
    pub role: String,
    pub id: String,
    pub sha256: String,
}

/// How much a split holds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SplitInfo {
    pub shards: Vec<ShardRef>,
    pub videos: Vec<String>,
    pub samples: usize,
    pub frames: usize,
    pub secs: f64,
}

/// What a dataset is beside its videos.
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
}

impl About {
    /// Of `speaker` at `fps`, made by this program; nothing else is said.
    pub fn new(speaker: &str, fps: FrameRate) -> Self {
        let nothing = String::new;
        Self {
            speaker: speaker.to_owned(),
            tool: concat!("orator ", env!("CARGO_PKG_VERSION")).to_owned(),
            fps,
            models: Vec::new(),
            licence: nothing(),
            consent: nothing(),
            source: nothing(),
            notes: Vec::new(),
        }
    }
}

impl DatasetInfo {
    /// The description of a dataset `about` with these videos and bones (48 lengths, metres).
    pub fn new(about: &About, bones: &[f32], splits: BTreeMap<Split, SplitInfo>, videos: Vec<DatasetVideo>) -> Self {
        let About { speaker, tool, fps, models, licence, consent, source, notes } = about.clone();
        Self {
            schema: super::SCHEMA,
            speaker,
            tool,
            fps,
            sound_rate: crate::types::sound::SAMPLE_RATE,
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
            splits: splits.into_iter().map(|(split, info)| (split.name().to_owned(), info)).collect(),
            videos,
        }
    }

    /// What it was made from, beside the videos.
    pub fn about(&self) -> About {
        let DatasetInfo { speaker, tool, fps, models, licence, consent, source, notes, .. } = self.clone();
        About { speaker, tool, fps, models, licence, consent, source, notes }
    }

    /// The shards of all splits.
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

/// Names of the 59 keypoints of a shard, in their order.
pub fn keypoint_names() -> Vec<String> {
    let paired = ["Eye", "Ear", "Shoulder", "Elbow", "Wrist", "Hip", "Knee", "Ankle"];
    let body = paired.iter().flat_map(|name| [format!("L{name}"), format!("R{name}")]);
    // a hand's points have the joints' order: the root is the wrist, then the fingers, base to tip
    let hand = |root: usize| (root..root + skeleton::N_HAND_JOINTS).map(skeleton::name);
    let mut names = Vec::with_capacity(N_KEYPOINTS);
    names.push("Nose".to_owned());
    names.extend(body.chain(hand(skeleton::L_HAND)).chain(hand(skeleton::R_HAND)));
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_keypoint_has_a_name_of_its_own() {
        let names = keypoint_names();
        assert_eq!(names.len(), N_KEYPOINTS);
        let different: std::collections::BTreeSet<_> = names.iter().collect();
        assert_eq!(different.len(), N_KEYPOINTS);
        assert_eq!((names[9].as_str(), names[17].as_str(), names[58].as_str()), ("LWrist", "LHandRoot", "RLittleTip"));
    }
}
