//! Speeds of the wrists, by which a motion is held against the rule.

use ndarray::{Array2, ArrayView3};
use orator_base::types::skeleton::{L_WRIST, R_WRIST};
use orator_base::types::time::FrameRate;

/// Left and right wrist.
pub const WRISTS: [usize; 2] = [L_WRIST, R_WRIST];
/// Speed of each wrist from each frame to the next, [T - 1, 2], m/s, no smoothing.
pub fn wrist_speeds(joints: ArrayView3<f32>, fps: FrameRate) -> Array2<f64> {
    Array2::from_shape_fn((joints.shape()[0].saturating_sub(1), 2), |(t, hand)| {
        let step = |k: usize| f64::from(joints[[t + 1, WRISTS[hand], k]] - joints[[t, WRISTS[hand], k]]);
        (0..3).map(|k| step(k).powi(2)).sum::<f64>().sqrt() * fps.per_sec()
    })
}
