//! Tracks of exponential maps (axis times angle) without the jumps from one side of half a turn to the other.

use crate::math::vec3::{Vec3, norm, scale, sub};
use std::f64::consts::TAU;

/// Takes a track's jumps out: of the two vectors of a rotation each frame gets the one nearer to the frame before.
/// FineMotion (Korzun et al. 2020) compares the angles of vectors alone, which finds no jump between vectors of up to half
/// a turn; this compares the vectors.
pub fn make_continuous(track: &mut [Vec3]) {
    for t in 1..track.len() {
        let (before, now) = (track[t - 1], track[t]);
        let angle = norm(now);
        if angle == 0.0 {
            continue;
        }
        // whole turns that bring the vector nearest to the one before
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
    fn a_turn_past_half_a_turn_and_back_has_no_jump() {
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
    fn a_track_without_jumps_stays() {
        let mut track: Vec<Vec3> = (0..50).map(|t| [0.02 * f64::from(t), 0.3, -0.1]).collect();
        let before = track.clone();
        make_continuous(&mut track);
        make_continuous(&mut []);
        assert_eq!(track, before);
    }
}
