//! 3D motion: joints over time in camera axes, metres, the neck at the origin.

use super::time::FrameRate;
use ndarray::{Array2, Array3};

/// Motion of the 49-joint skeleton (`skeleton`): x image right, y down, z away from the camera, float32 metres, the
/// neck at the origin of every frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Frames a second.
    pub fps: FrameRate,
    /// [T, 49, 3]; a missing joint is NaN.
    pub joints: Array3<f32>,
    /// [T, 49]; false where the joint was not seen (missing, or filled over a gap).
    pub mask: Array2<bool>,
}

impl Motion {
    /// From joints [T, 49, 3] alone: what is not finite was not seen.
    pub fn from_joints(fps: FrameRate, joints: Array3<f32>) -> Self {
        let mask = joints.map_axis(ndarray::Axis(2), |place| place.iter().all(|v| v.is_finite()));
        Self { fps, joints, mask }
    }

    /// Number of frames T.
    pub fn n_frames(&self) -> usize {
        self.joints.shape()[0]
    }
}
