//! Opening of the mouth, in the axes of the head: the part below the mouth line rotates down about the jaw's hinge.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, scale, sub};

/// Height of the closed mouth, and half its width, cm.
pub const MOUTH_Y: f64 = 4.45;
pub const MOUTH_HALF: f64 = 2.5;
/// Hinge of the jaw (y, z), cm, and its rotation with the mouth fully open, degrees.
const HINGE: [f64; 2] = [7.5, 0.4];
const MAX_JAW_DEGREES: f64 = 17.0;

/// Smooth step from 0 at -1 to 1 at 1.
pub fn smooth_step(at: f64) -> f64 {
    let t = ((at + 1.0) / 2.0).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Fraction of the jaw rotation that a point of the head follows, 0..1.
pub fn jaw_share([x, y, z]: Vec3) -> f64 {
    // The transition is sharp at the lips and ever more gradual towards the cheeks.
    let gradual = 0.22 + 0.9 * (x.abs() - 2.1).max(0.0) + 0.5 * (7.5 - z).max(0.0) * smooth_step(x.abs() - 2.5);
    let below = smooth_step((MOUTH_Y - y) / gradual);
    // The nape, the ears and the throat do not move.
    below * smooth_step((z - 2.6) / 2.8) * smooth_step((y + 2.2) / 1.6)
}

/// Displacement of a point when the mouth opens fully, for a given jaw fraction, cm.
pub fn opening(at: Vec3, share: f64) -> Vec3 {
    let hinge = [0.0, HINGE[0], HINGE[1]];
    let turned = Rotation::about([1.0, 0.0, 0.0], MAX_JAW_DEGREES.to_radians()).turn(sub(at, hinge));
    scale(sub(add(turned, hinge), at), share)
}
