//! Resting hands: hidden stretches are filled, however long. A hand keeps the shape that it has where it is visible
//! during the same rest; if it is not visible at all, it gets the mirrored shape of the other hand.

use super::gaps;
use ndarray::{ArrayViewMut3, s};
use orator_base::types::interval::Interval;
use orator_base::types::pose2d::N_HAND;
use orator_base::types::skeleton::{L_HAND, R_HAND};

/// Fills the hands of `joints` [T, 49, 3], the frames of `interval`, in the intervals `resting` of the video. Each
/// hand has its wrist at 0; a missing one is NaN, and remains so in a rest in which neither hand is visible.
pub fn fill(joints: &mut ArrayViewMut3<f32>, interval: Interval, resting: &[Interval]) {
    for rest in resting {
        let [start, end] = [rest.start, rest.end].map(|t| t.clamp(interval.start, interval.end) - interval.start);
        if start >= end {
            continue;
        }
        for root in [L_HAND, R_HAND] {
            let mut hand = joints.slice_mut(s![start..end, root..root + N_HAND, ..]);
            gaps::bridge(hand.view_mut(), end - start);
            gaps::hold_ends(hand, end - start);
        }
        // Each hand is now present either in all frames of the rest or in none.
        for (root, other) in [(L_HAND, R_HAND), (R_HAND, L_HAND)] {
            if joints[[start, root, 0]].is_nan() {
                for t in start..end {
                    for j in 0..N_HAND {
                        let [x, y, z] = [0, 1, 2].map(|k| joints[[t, other + j, k]]);
                        joints.slice_mut(s![t, root + j, ..]).assign(&ndarray::arr1(&[-x, y, z]));
                    }
                }
            }
        }
    }
}
