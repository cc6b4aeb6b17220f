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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rotation::Rotation;

    #[test]
    fn a_rotation_past_180_degrees_and_back_has_no_jump() {
        let axis = [0.6, 0.0, 0.8];
        let angle = |t: usize| 2.5 + 1.2 * (t as f64 * 0.1).sin();
        let mut track: Vec<Vec3> = (0..100).map(|t| Rotation::about(axis, angle(t)).rotation_vector()).collect();
        let widest = |track: &[Vec3]| track.windows(2).map(|pair| norm(sub(pair[1], pair[0]))).fold(0.0, f64::max);
        assert!(widest(&track) > 5.0);
        make_continuous(&mut track);
        assert!(widest(&track) < 0.13, "{}", widest(&track));
        for (t, vector) in track.iter().enumerate() {
            assert!(norm(sub(*vector, scale(axis, angle(t)))) < 1e-9, "{t}");
        }
    }

    #[test]
    fn a_continuous_track_is_unchanged() {
        let mut track: Vec<Vec3> = (0..50).map(|t| [0.02 * f64::from(t), 0.3, -0.1]).collect();
        let before = track.clone();
        make_continuous(&mut track);
        make_continuous(&mut []);
        assert_eq!(track, before);
    }
}
