//! The neck of every skeleton in training and evaluation. The neck joint of a capture lies 50 to 60 mm above the line
//! of the shoulders, by another amount in each capture, while the lifter's is on it.

use orator_base::math::vec3::{Vec3, add, scale};

/// Midpoint of the shoulders.
pub fn neck(right_shoulder: Vec3, left_shoulder: Vec3) -> Vec3 {
    scale(add(right_shoulder, left_shoulder), 0.5)
}
