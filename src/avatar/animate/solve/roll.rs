//! Roll of an upper arm. The elbow axis is perpendicular to upper arm and forearm, which a straight arm does not
//! determine. A reference axis is transported with the upper arm without roll, the elbow plane is measured relative to
//! it where the arm is bent, and the roll is interpolated between such frames and held outside.

use super::track::{ObservedTrack, smoothstep};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, across, cross, dot, unit};

/// Elbow angles, degrees (0 is straight), between which the weight of the measured plane rises from 0 to 1.
const STRAIGHT_DEGREES: [f64; 2] = [8.0, 20.0];
/// Left upper arm and its elbow axis at rest.
pub const REST: (Vec3, Vec3) = ([1.0, 0.0, 0.0], [0.0, -1.0, 0.0]);
/// Weight of roll changes relative to the measured planes.
const SMOOTHNESS: f64 = 0.02;
/// Weight of the transported roll, small enough to matter only without any measurement.
const TRANSPORTED_WEIGHT: f64 = 1e-9;

/// Rotations of the upper arm from the directions of upper arm and forearm in the clavicle's axes; `None` where the
/// upper arm was not detected.
pub fn upper_arm_rotations(upper: &[Option<Vec3>], forearm: &[Option<Vec3>]) -> ObservedTrack {
    // Transported axis, and the roll measured relative to it with its weight.
    let mut transported = REST;
    let mut frames: Vec<(usize, (Vec3, Vec3))> = Vec::with_capacity(upper.len());
    let mut measured: Vec<[f64; 2]> = Vec::with_capacity(upper.len());
    let mut last_roll = 0.0;
    for (t, (upper, forearm)) in upper.iter().zip(forearm).enumerate() {
        let Some(upper) = *upper else { continue };
        let axis = across(Rotation::between(transported.0, upper).turn(transported.1), upper);
        transported = (upper, unit(axis, 1e-9).unwrap_or(transported.1));
        let measurement = forearm.and_then(|forearm| {
            let axis = unit(cross(upper, forearm), 1e-9)?;
            let bent = dot(upper, forearm).clamp(-1.0, 1.0).acos().to_degrees();
            let roll = dot(cross(transported.1, axis), upper).atan2(dot(transported.1, axis));
            Some((roll, smoothstep(STRAIGHT_DEGREES, bent)))
        });
        let (roll, weight) = measurement.unwrap_or((last_roll, 0.0));
        let near = last_roll + wrapped(roll - last_roll);
        last_roll += weight * (near - last_roll);
        frames.push((t, transported));
        measured.push([near, weight]);
    }
    let mut rolls = vec![None; upper.len()];
    for ((t, transported), roll) in frames.into_iter().zip(smoothed_rolls(&measured)) {
        rolls[t] = Some(Rotation::about(transported.0, roll) * Rotation::between_frames(REST, transported));
    }
    rolls
}

/// Rolls close to the measured ones (value, weight) that change evenly where nothing is measured: the minimum of `sum w
/// (r - m)^2 + SMOOTHNESS sum (r[t] - r[t - 1])^2`, a tridiagonal system.
pub fn smoothed_rolls(measured: &[[f64; 2]]) -> Vec<f64> {
    let n = measured.len();
    let mut ahead: Vec<[f64; 2]> = Vec::with_capacity(n);
    for (t, &[roll, weight]) in measured.iter().enumerate() {
        let neighbours = f64::from(u8::from(t > 0)) + f64::from(u8::from(t + 1 < n));
        let (diagonal, right) = (weight + TRANSPORTED_WEIGHT + SMOOTHNESS * neighbours, weight * roll);
        let [link, value] = ahead.last().copied().unwrap_or([0.0, 0.0]);
        let pivot = diagonal - if t > 0 { SMOOTHNESS * link } else { 0.0 };
        ahead.push([SMOOTHNESS / pivot, (right + if t > 0 { SMOOTHNESS * value } else { 0.0 }) / pivot]);
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
