//! Jerk: the third difference of positions over time.

use ndarray::{ArrayView2, ArrayView3};

/// Mean norm of the jerk (m/s^3) of `joints` in `positions` [T, n, 3] at `fps` frames per second. Each pair is a joint
/// and the joint that it is measured relative to (the root for none). Only windows of four frames in which both joints
/// are visible in `visible` [T, n] are counted; `None` if there is none.
pub fn mean(positions: ArrayView3<f32>, visible: ArrayView2<bool>, fps: f64, joints: &[(usize, usize)]) -> Option<f64> {
    let (mut sum, mut n) = (0.0, 0usize);
    for start in 0..positions.shape()[0].saturating_sub(3) {
        for &(joint, origin) in joints {
            if !(start..start + 4).all(|t| visible[[t, joint]] && visible[[t, origin]]) {
                continue;
            }
            let squares = (0..3).map(|axis| {
                let at = |t: usize| {
                    f64::from(positions[[start + t, joint, axis]]) - f64::from(positions[[start + t, origin, axis]])
                };
                (at(3) - 3.0 * at(2) + 3.0 * at(1) - at(0)).powi(2)
            });
            sum += squares.sum::<f64>().sqrt();
            n += 1;
        }
    }
    (n > 0).then(|| sum / n as f64 * fps.powi(3))
}
