//! The nine keypoints of the upper body that the body lifter uses, and their normalisation in size.

use crate::math::order::upper_median;
use crate::math::vec3::{self, Vec3};
use crate::types::pose2d::coco;
use crate::types::skeleton::BODY_BONES;
pub use crate::types::skeleton::{L_ELBOW, L_SHOULDER, L_WRIST, R_ELBOW, R_SHOULDER, R_WRIST};

/// Number of keypoints: nose; right shoulder, elbow, wrist; left shoulder, elbow, wrist; right hip, left hip.
pub const N_POINTS: usize = 9;
pub const NOSE: usize = 0;
pub const R_HIP: usize = 7;
pub const L_HIP: usize = 8;

/// COCO index of each keypoint.
pub const COCO: [usize; N_POINTS] = [
    coco::NOSE,
    coco::R_SHOULDER,
    coco::R_ELBOW,
    coco::R_WRIST,
    coco::L_SHOULDER,
    coco::L_ELBOW,
    coco::L_WRIST,
    coco::R_HIP,
    coco::L_HIP,
];

/// Keypoints of the arms, whose indices equal those of the skeleton's joints.
pub const ARMS: std::ops::RangeInclusive<usize> = R_SHOULDER..=L_WRIST;

/// Index of each keypoint's counterpart on the other side.
pub const MIRROR: [usize; N_POINTS] = [NOSE, L_SHOULDER, L_ELBOW, L_WRIST, R_SHOULDER, R_ELBOW, R_WRIST, L_HIP, R_HIP];

/// Nine keypoints in camera axes (x right, y down, z away), relative to the neck, the midpoint of the shoulders.
pub type Pose = [Vec3; N_POINTS];

/// Nine keypoints of a picture, x and y in px; `None`: not visible.
pub type BodyPoints = [Option<[f32; 2]>; N_POINTS];

/// Directions of the right and the left hand of a frame, from the wrist to the mean of the four knuckles, as unit
/// vectors in camera axes; `None`: not known.
pub type HandDirections = [Option<[f32; 3]>; 2];

/// Size in metres, in the sense of `size`, to which every body is scaled: a picture does not show a person's size.
pub const REFERENCE_SIZE: f64 = 0.90;

/// Sum of the shoulder width, the mean upper arm length and the mean forearm length.
pub fn size(pose: &Pose) -> f64 {
    let bone = |(a, b): (usize, usize)| vec3::norm(vec3::sub(pose[a], pose[b]));
    bone(BODY_BONES[0]) + (bone(BODY_BONES[1]) + bone(BODY_BONES[2]) + bone(BODY_BONES[3]) + bone(BODY_BONES[4])) / 2.0
}

/// Metres per unit of `poses` that scale their median size to `REFERENCE_SIZE`; 1 if there is nothing to measure.
pub fn metres_per_unit(poses: &[Pose]) -> f64 {
    upper_median(poses.iter().map(size).filter(|s| *s > 0.0)).map_or(1.0, |s| REFERENCE_SIZE / s)
}
