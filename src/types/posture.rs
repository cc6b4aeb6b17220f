//! What a speaker's trunk and head do beside the 49 joints.

use ndarray::Array2;

/// Angles of trunk and head, frame by frame, in the axes of the motion they belong to, radians; NaN where they are not
/// seen. Both are of the world, not of one against the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Posture {
    /// [T, 3]: yaw to the person's left, pitch downwards, roll towards the right shoulder. Of the head, 0 when it looks
    /// into the camera as it does in the clip's median.
    pub head: Array2<f32>,
    /// [T, 3]: the same of the trunk, from the hips to the neck; pitch is the lean forward.
    pub trunk: Array2<f32>,
}
