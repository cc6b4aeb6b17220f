//! Tracks of exponential maps (axis times angle) without jumps between the two representations of a rotation.

use crate::math::vec3::{Vec3, norm, scale, sub};
use std::f64::consts::TAU;

/// Removes the jumps of a track: each frame gets the one of the two vectors of its rotation that is closer to the
/// frame before. FineMotion (Korzun et al. 2020) compares only the angles of the vectors, which detects no jump
/// between vectors of up to half a turn; this function compares the vectors.
pub fn make_continuous(track: &mut [Vec3]) {
    for t in 1..track.len() {
        let (before, now) = (track[t - 1], track[t]);
        let angle = norm(now);
        if angle == 0.0 {
            continue;
        }
        // The number of full turns that brings the vector closest to the one before.
        let along = (0..3).map(|k| before[k] * now[k]).sum::<f64>() / angle;
        let turns = ((along - angle) / TAU).round();
        let other = scale(now, (angle + turns * TAU) / angle);
        if norm(sub(other, before)) < norm(sub(now, before)) {
            track[t] = other;
        }
    }
}
