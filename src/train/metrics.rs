//! What a validation during training says.

use serde::{Deserialize, Serialize};

/// A predictor's figures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Mean absolute error of normalised coordinates.
    pub l1: f64,
    /// Share of correct keypoints, 0..1.
    pub pck: f64,
}

/// The generator beside the pose that never moves from the mean, on the same windows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Validation {
    /// The split they were measured on.
    pub split: String,
    pub n_windows: usize,
    pub generator: Figures,
    pub mean_pose: Figures,
}
