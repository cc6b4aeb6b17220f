//! Description of one model: its sources, preprocessing and decoding. A strict data type (unknown keys are errors).

use super::convert::SourceFormat;
use super::{Conversion, ModelSource, SourceFile};
use serde::{Deserialize, Serialize};

/// One model, a file or a folder of files: its identity, sources, preprocessing and decoding.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelEntry {
    pub id: String,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub about: String,
    pub role: ModelRole,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub file: String,
    /// SHA-256 of the file, 64 hex digits.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub sha256: String,
    #[serde(default)]
    pub bytes: u64,
    /// Files of a model that is a folder named `file`, the weights last; empty if it is a single file.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<SourceFile>,
    /// URL that serves exactly the pinned bytes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub url: Option<String>,
    /// Sources of the files from which the model is built, in the order in which they are tried, after `url`. A folder
    /// needs all of its sources.
    #[serde(default, rename = "source", skip_serializing_if = "Vec::is_empty")]
    pub sources: Vec<ModelSource>,
    /// Conversion from the files of a source; `None`: the single file of a source is the model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub convert: Option<Conversion>,
    /// Tool and steps by which the file was converted, for models without a source for the original files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub conversion: Option<String>,
    pub inputs: Vec<Port>,
    pub outputs: Vec<Port>,
    /// Preprocessing and decoding of image models; speech models do not use these three fields.
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

/// A named tensor; -1 is any size.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Port {
    pub name: String,
    pub shape: Vec<i64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ModelRole {
    Person,
    Body,
    Hand,
    Palm,
    Face,
    Speech,
    /// A folder with a Whisper network, for speech recognition.
    Recogniser,
    Other,
}

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

/// Normalisation from pixels to tensor: `(pixel * scale - mean) / std`, in the order of `channels`.
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

/// How the image is fitted into the input.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum PictureFit {
    /// The complete image with its aspect ratio preserved, padded with grey level `pad`.
    Letterbox { anchor: Anchor, pad: u8 },
    /// A person's bounding box extended to the aspect ratio of the input, then by `margin`; black outside the image.
    Box { margin: f64 },
    /// A rotated square; black outside the image.
    #[default]
    Region,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Anchor {
    TopLeft,
    Centre,
}

/// Meaning of the outputs; string fields are output names.
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
        /// Width of the blur before refinement, an odd number of cells.
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
    /// Not decoded by any stage, or decoded by the code for its role.
    #[default]
    None,
}

/// Sub-cell refinement of a heat-map peak.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Refine {
    None,
    Quarter,
    Dark,
}

/// Index of the output for each keypoint; empty if the model does not predict these keypoints.
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
    /// Whether the model, or the files from which it is built, can be downloaded.
    pub fn is_served(&self) -> bool {
        self.url.is_some() || !self.sources.is_empty()
    }

    /// Number of values of the input.
    pub fn input_len(&self) -> usize {
        let shape = self.inputs.first().map(|port| port.shape.as_slice()).unwrap_or_default();
        shape.iter().map(|side| usize::try_from(*side).unwrap_or(0)).product()
    }

    /// Whether the file accepts any number of pictures per run: those converted from ncnn and TFLite do.
    pub fn accepts_batches(&self) -> bool {
        let format = self.convert.as_ref().map(|conversion| conversion.format);
        matches!(format, Some(SourceFormat::Ncnn | SourceFormat::Tflite))
    }

    /// Description of the model, its origin and its licence, for users.
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
