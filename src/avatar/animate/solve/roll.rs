//! Roll of an upper arm. The elbow's axis lies across upper arm and forearm; a straight arm does not show it. The axis
//! is transported with the upper arm without roll, the elbow's plane is measured against it where the arm is bent, and
//! the roll is interpolated between and held outside such frames.

use super::track::{ObservedTrack, smoothstep};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, across, cross, dot, unit};

/// Elbow angles, degrees (0: straight), between which the plane's weight rises from 0 to 1.
const STRAIGHT_DEGREES: [f64; 2] = [8.0, 20.0];
/// Left upper arm and its elbow's axis at rest.
const REST: (Vec3, Vec3) = ([1.0, 0.0, 0.0], [0.0, -1.0, 0.0]);
/// Weight of a change of roll against a frame's measured plane.
const EVEN: f64 = 0.02;
/// Weight of the transported roll, which decides only where nothing is measured.
const CARRIED: f64 = 1e-9;

/// Rotations of the upper arm from the directions of upper arm and forearm in the clavicle's axes; `None` where the
/// upper arm is not seen.
pub fn elbow_axes(upper: &[Option<Vec3>], fore: &[Option<Vec3>]) -> ObservedTrack {
    // Transported axis, and the measured roll against it with its weight.
    let mut carried = REST;
    let mut frames: Vec<(usize, (Vec3, Vec3))> = Vec::with_capacity(upper.len());
    let mut measured: Vec<[f64; 2]> = Vec::with_capacity(upper.len());
    let mut trusted = 0.0;
    for (t, (upper, fore)) in upper.iter().zip(fore).enumerate() {
        let Some(upper) = *upper else { continue };
        let axis = across(Rotation::between(carried.0, upper).turn(carried.1), upper);
        carried = (upper, unit(axis, 1e-9).unwrap_or(carried.1));
        let seen = fore.and_then(|fore| {
            let axis = unit(cross(upper, fore), 1e-9)?;
            let bent = dot(upper, fore).clamp(-1.0, 1.0).acos().to_degrees();
            let roll = dot(cross(carried.1, axis), upper).atan2(dot(carried.1, axis));
            Some((roll, smoothstep(STRAIGHT_DEGREES, bent)))
        });
        let (roll, weight) = seen.unwrap_or((trusted, 0.0));
        let near = trusted + wrapped(roll - trusted);
        trusted += weight * (near - trusted);
        frames.push((t, carried));
        measured.push([near, weight]);
    }
    let mut rolls = vec![None; upper.len()];
    for ((t, carried), roll) in frames.into_iter().zip(evened(&measured)) {
        rolls[t] = Some(Rotation::about(carried.0, roll) * Rotation::between_frames(REST, carried));
    }
    rolls
}

/// Rolls nearest to the measured ones (value, weight) that change evenly where nothing is measured: the minimum of `sum
/// w (r - m)^2 + EVEN sum (r[t] - r[t - 1])^2`, a tridiagonal system.
fn evened(measured: &[[f64; 2]]) -> Vec<f64> {
    let n = measured.len();
    let mut ahead: Vec<[f64; 2]> = Vec::with_capacity(n);
    for (t, &[roll, weight]) in measured.iter().enumerate() {
        let neighbours = f64::from(u8::from(t > 0)) + f64::from(u8::from(t + 1 < n));
        let (diagonal, right) = (weight + CARRIED + EVEN * neighbours, weight * roll);
        let [link, value] = ahead.last().copied().unwrap_or([0.0, 0.0]);
        let pivot = diagonal - if t > 0 { EVEN * link } else { 0.0 };
        ahead.push([EVEN / pivot, (right + if t > 0 { EVEN * value } else { 0.0 }) / pivot]);
    }
    let mut rolls = vec![0.0; n];
    let mut next = 0.0;
    for (t, [link, value]) in ahead.into_iter().enumerate().rev() {
        next = value + if t + 1 < n { link * next } else { 0.0 };
        rolls[t] = next;
    }
    rolls
}

fn wrapped(angle: f64) -> f64 {
    angle - std::f64::consts::TAU * (angle / std::f64::consts::TAU).round()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seen_rolls_stay_and_unseen_ones_pass_evenly() {
        let measured: Vec<[f64; 2]> =
            (0..40).map(|t| if (10..30).contains(&t) { [9.0, 0.0] } else { [f64::from(t / 20), 1.0] }).collect();
        let rolls = evened(&measured);
        assert!(rolls[0].abs() < 1e-3 && (rolls[39] - 1.0).abs() < 1e-3);
        assert!(rolls.windows(2).all(|pair| (-1e-9..0.06).contains(&(pair[1] - pair[0]))), "{rolls:?}");
        assert!((rolls[19] + rolls[20] - 1.0).abs() < 1e-4);
        assert_eq!(evened(&[]), Vec::<f64>::new());
        assert!(evened(&[[3.0, 0.0]; 5]).iter().all(|roll| roll.abs() < 1e-6));
    }

    #[test]
    fn the_elbow_bends_about_its_axis() {
        let upper = vec![unit([0.3, -0.9, 0.1], 0.0); 20];
        let fore = vec![unit([0.2, 0.1, 0.9], 0.0); 20];
        for rotation in elbow_axes(&upper, &fore) {
            let rotation = rotation.unwrap();
            assert!(dot(rotation.turn(REST.0), upper[0].unwrap()) > 1.0 - 1e-9);
            let into = rotation.inverse().turn(fore[0].unwrap());
            assert!(into[1].abs() < 1e-4 && into[2] > 0.0, "{into:?}");
        }
    }
}
