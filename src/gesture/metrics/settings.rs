//! Convention and parameters of the metrics.

use orator_base::types::posture::PostureChannel;
use orator_base::types::time::FrameRate;
use serde::{Deserialize, Serialize};

/// Settings of the metrics.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MetricSettings {
    /// Convention whose definitions apply.
    pub convention: Convention,
    /// Tolerances of PCK as shares of the largest extent of the pose, each > 0.
    pub alphas: Vec<f64>,
    /// Frame rate of all motion.
    pub fps: FrameRate,
    /// Whether errors and speeds are also measured over all 49 joints, including the neck.
    pub with_neck: bool,
    /// Whether any finger is visible; otherwise metrics of complete poses are restricted to the arms.
    pub has_fingers: bool,
    /// Posture channels that are measured in addition to the joints.
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

/// Convention, named after the publication or project that defines it.
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
