//! Under which convention metrics are taken, and their parameters.

use orator_base::types::posture::PostureChannel;
use orator_base::types::time::FrameRate;
use serde::{Deserialize, Serialize};

/// What the numbers are set to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MetricSettings {
    /// Whose definitions count.
    pub convention: Convention,
    /// Shares of the pose's largest extent for PCK, each > 0.
    pub alphas: Vec<f64>,
    /// Frame rate of all motion.
    pub fps: FrameRate,
    /// Whether errors and speeds are also given over 49 joints, the neck included.
    pub with_neck: bool,
    /// Whether any finger is seen; where none is, numbers of whole poses are of the arms.
    pub has_fingers: bool,
    /// What is measured beside the joints.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub channels: Vec<PostureChannel>,
}

impl Default for MetricSettings {
    fn default() -> Self {
        Self {
            convention: Convention::default(),
            alphas: vec![0.2, 0.1],
            fps: FrameRate::new(15, 1),
            with_neck: false,
            has_fingers: true,
            channels: Vec::new(),
        }
    }
}

/// Whose definitions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Convention {
    /// Definitions of this project.
    #[default]
    Orator,
    /// Ginosar et al. 2019.
    Speech2gesture,
    /// The GENEA challenges.
    Genea,
    /// Liu et al. 2024.
    Emage,
    /// Yoon et al. 2020.
    Trimodal,
    /// Li et al. 2021.
    Aist,
}
