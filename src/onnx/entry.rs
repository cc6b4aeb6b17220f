//! The description of one model: where it comes from, how its input is made and its outputs are read. Typed, strict (an
//! unknown key is an error) and data only.

use super::{Conversion, ModelSource};
use serde::{Deserialize, Serialize};

/// One model file: what it is, where it is from, how it is fed and read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelEntry {
    pub id: String,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub about: String,
    pub role: ModelRole,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub file: String,
    /// 64 hex digits of the file's content.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub sha256: String,
    #[serde(default)]
    pub bytes: u64,
    /// Serves exactly the pinned bytes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub url: Option<String>,
    /// Where the files it is made of are, in the order in which they are tried; after `url`.
    #[serde(default, rename = "source", skip_serializing_if = "Vec::is_empty")]
    pub sources: Vec<ModelSource>,
    /// How it is made of the files of a source; none: the one file of a source is the model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub convert: Option<Conversion>,
    /// Tool and steps that made the file from its origin, where no source has what it is made of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub conversion: Option<String>,
    pub inputs: Vec<Port>,
    pub outputs: Vec<Port>,
    /// What a model of pictures is fed; a speech model has none of these three.
    #[serde(default)]
    pub picture: InputPicture,
    #[serde(default)]
    pub fit: PictureFit,
    #[serde(default)]
    pub decode: Decode,
    #[serde(default, skip_serializing_if = "KeypointOutputs::is_empty")]
    pub points: KeypointOutputs,
    #[serde(default)]
    pub origin: ModelOrigin,
}

/// A named tensor; -1 stands for any size.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Port {
    pub name: String,
    pub shape: Vec<i64>,
}

/// What a model is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ModelRole {
    Person,
    Body,
    Hand,
    Palm,
    Face,
    Speech,
    Other,
}

/// Where the weights come from and under which terms.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelOrigin {
    pub repository: String,
    pub commit: String,
    pub path: String,
    pub licence: String,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub note: String,
}

/// Pixel to tensor: `(pixel * scale - mean) / std`, in the order of `channels`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputPicture {
    pub channels: Channels,
    pub axes: TensorAxes,
    #[serde(default = "one")]
    pub scale: f64,
    #[serde(default)]
    pub mean: [f64; 3],
    #[serde(default = "ones")]
    pub std: [f64; 3],
}

impl Default for InputPicture {
    fn default() -> Self {
        Self { channels: Channels::Rgb, axes: TensorAxes::Nchw, scale: one(), mean: [0.0; 3], std: ones() }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Channels {
    Rgb,
    Bgr,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TensorAxes {
    Nchw,
    Nhwc,
}

/// How the picture gets into the input.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum PictureFit {
    /// The whole picture, its shape kept, grey level `pad` around it.
    Letterbox { anchor: Anchor, pad: u8 },
    /// A person's box grown to the input's shape, then by `margin`; outside black.
    Box { margin: f64 },
    /// A rotated square; outside black.
    #[default]
    Region,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Anchor {
    TopLeft,
    Centre,
}

/// What the outputs mean; the names are names of outputs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Decode {
    Detections {
        boxes: String,
        labels: Option<String>,
        #[serde(default)]
        person: i64,
        min_score: f32,
        max_overlap: f32,
    },
    YoloxGrid {
        predictions: String,
        strides: Vec<usize>,
        min_score: f32,
        max_overlap: f32,
    },
    Heatmap {
        heatmap: String,
        refine: Refine,
        /// Width of the blur before refining: an odd number of cells.
        #[serde(default = "three")]
        blur: usize,
    },
    Simcc {
        x: String,
        y: String,
        split: f64,
    },
    Regression {
        landmarks: String,
        score: String,
        /// The score is a logit.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        logit: bool,
        right: Option<String>,
    },
    SsdAnchors {
        regressors: String,
        scores: String,
        strides: Vec<usize>,
        min_score: f32,
        max_overlap: f32,
        wrist: usize,
        middle: usize,
    },
    /// Read by no stage, or by the code of its role.
    #[default]
    None,
}

/// How a heat-map's peak is placed between the cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Refine {
    None,
    Quarter,
    Dark,
}

/// Which output is which keypoint; empty: the model does not give it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct KeypointOutputs {
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub body: Vec<usize>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub hand: Vec<usize>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_hand: Vec<usize>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub right_hand: Vec<usize>,
}

impl ModelEntry {
    /// Whether some place serves it, or what it is made of.
    pub fn is_served(&self) -> bool {
        self.url.is_some() || !self.sources.is_empty()
    }

    /// What the model is, where it comes from and under which terms, for people.
    pub fn terms(&self) -> String {
        let ModelOrigin { repository, commit, path, licence, note } = &self.origin;
        let note = if note.is_empty() { String::new() } else { format!("\n{note}") };
        format!("{}\nsha256 {}\nfrom {repository} @ {commit} : {path}\nlicence {licence}{note}\n", self.id, self.sha256)
    }
}

impl KeypointOutputs {
    fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

fn one() -> f64 {
    1.0
}

fn ones() -> [f64; 3] {
    [1.0; 3]
}

fn three() -> usize {
    3
}
