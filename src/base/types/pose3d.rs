//! 3D motion: joint positions over time in camera axes, in metres, with the neck at the origin.

use super::skeleton;
use super::time::FrameRate;
use ndarray::{Array2, Array3};

/// Motion of the 49-joint skeleton (`skeleton`): x image right, y down, z away from the camera, float32 metres; the
/// neck is the origin of every frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    pub fps: FrameRate,
    /// [T, 49, 3]; a missing joint is NaN.
    pub joints: Array3<f32>,
    /// [T, 49]; false if the joint was not visible (missing, or interpolated over a gap).
    pub mask: Array2<bool>,
}

/// Maximum plausible coordinate of a joint relative to the neck: in metres, or in medians of all coordinates if that
/// is larger, so that motion in millimetres is distinguished from a single outlier.
const FARTHEST: f32 = 100.0;
/// Maximum coordinate in any unit, far below what overflows.
const FARTHEST_OF_ALL: f32 = 1e5;

/// Error: implausibly distant joint.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "frame {frame}, joint {joint} ({}): {position:?} is implausible: expected metres, under {FARTHEST} m from the neck",
    skeleton::name(*joint)
)]
pub struct FarJoint {
    /// Frame index, from 0.
    pub frame: usize,
    /// Joint index, 0..49.
    pub joint: usize,
    /// Position as read.
    pub position: [f32; 3],
}

impl Motion {
    /// Creates motion from joints [T, 49, 3]; joints with a non-finite coordinate are masked as not visible.
    pub fn from_joints(fps: FrameRate, joints: Array3<f32>) -> Self {
        let mask = joints.map_axis(ndarray::Axis(2), |joint| joint.iter().all(|v| v.is_finite()));
        Self { fps, joints, mask }
    }

    /// Checks that every joint is missing or within 100 m of the neck; called once, when a file is read. Motion that
    /// is large as a whole passes, because a later check reports that it is not in metres.
    ///
    /// # Errors
    /// `FarJoint`, the first joint that is too far.
    pub fn in_range(self) -> Result<Self, FarJoint> {
        let mut sizes: Vec<f32> = self.joints.iter().map(|v| v.abs()).filter(|v| v.is_finite()).collect();
        let middle = sizes.len() / 2;
        let median = if sizes.is_empty() { 0.0 } else { *sizes.select_nth_unstable_by(middle, f32::total_cmp).1 };
        let farthest = (FARTHEST * median.max(1.0)).min(FARTHEST_OF_ALL);
        for (frame, joints) in self.joints.outer_iter().enumerate() {
            for (joint, at) in joints.outer_iter().enumerate() {
                let position = std::array::from_fn(|k| at[k]);
                if position.iter().all(|v: &f32| v.is_finite()) && position.iter().any(|v| v.abs() > farthest) {
                    return Err(FarJoint { frame, joint, position });
                }
            }
        }
        Ok(self)
    }

    pub fn n_frames(&self) -> usize {
        self.joints.shape()[0]
    }
}
