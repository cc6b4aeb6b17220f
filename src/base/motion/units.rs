//! Unit and vertical direction of joints from the arms: upper arm and forearm of a person are 0.1 to 0.6 m long.

use crate::math::order;
use crate::types::pose3d::Motion;
use crate::types::skeleton::{ARM_BONES, L_ELBOW, L_WRIST, NECK, R_ELBOW, R_WRIST};
use anyhow::{Result, bail};
use std::ops::RangeInclusive;

/// Common units other than the metre, with their factors to metres.
const UNITS: [(&str, f32); 8] = [
    ("feet", 0.3048),
    ("decimetres", 0.1),
    ("inches", 0.0254),
    ("centimetres", 0.01),
    ("millimetres", 0.001),
    ("metres divided by 10", 10.0),
    ("metres divided by 100", 100.0),
    ("metres divided by 1000", 1000.0),
];
/// Median length of a person's arm bones in metres: typical adult, plausible range, and the wider range that is
/// accepted for small and large characters.
const ADULT: f32 = 0.27;
const PLAUSIBLE: RangeInclusive<f32> = 0.1..=0.6;
const ACCEPTED: RangeInclusive<f32> = 0.05..=0.8;
/// Fraction of the frames with the arms above the neck at which y seems to point up, and the minimum number of frames.
const UPSIDE_DOWN: f64 = 0.98;
const MIN_FRAMES: usize = 15;

/// Returns the median length of upper arms and forearms; `None` if no frame has an arm.
pub fn arm_bone(motion: &Motion) -> Option<f32> {
    let joints = &motion.joints;
    let length = |t: usize, (a, b): (usize, usize)| {
        (0..3).map(|k| (joints[[t, a, k]] - joints[[t, b, k]]).powi(2)).sum::<f32>().sqrt()
    };
    order::median((0..motion.n_frames()).flat_map(|t| ARM_BONES.map(|bone| length(t, bone))).collect::<Vec<_>>())
}

/// Checks that the joints are in metres; motion without arms passes.
///
/// # Errors
/// The arm bones are too short or too long; the message names the most likely unit and how to convert it.
pub fn check(motion: &Motion) -> Result<()> {
    let Some(length) = arm_bone(motion).filter(|length| !ACCEPTED.contains(length)) else { return Ok(()) };
    let unlikely = |metres: f32| (length * metres / ADULT).ln().abs();
    let fitting = UNITS.into_iter().filter(|(_, metres)| PLAUSIBLE.contains(&(length * metres)));
    let expected = "expected 0.1 to 0.6: coordinates are metres relative to the neck (x image right, y down, z away)";
    match fitting.min_by(|a, b| unlikely(a.1).total_cmp(&unlikely(b.1))) {
        Some((unit, metres)) => bail!(
            "its arm bones are {length:.3} long, {expected}; the file seems to be in {unit}; multiply every coordinate by \
             {metres}"
        ),
        None => bail!("its arm bones are {length:.3} long, which is implausible in every known unit; {expected}"),
    }
}

/// Returns whether y points up: elbows and wrists are above the neck in nearly every frame.
pub fn is_upside_down(motion: &Motion) -> bool {
    let joints = &motion.joints;
    let mut n = [0usize; 2];
    for frame in joints.outer_iter() {
        let below = [L_ELBOW, R_ELBOW, L_WRIST, R_WRIST].map(|joint| frame[[joint, 1]] - frame[[NECK, 1]]);
        if below.iter().all(|y| y.is_finite()) {
            n = [n[0] + 1, n[1] + usize::from(below.iter().all(|y| *y < 0.0))];
        }
    }
    n[0] >= MIN_FRAMES && n[1] as f64 >= UPSIDE_DOWN * n[0] as f64
}
