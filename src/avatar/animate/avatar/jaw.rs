//! Opening of the mouth in the axes of the head: what lies below the mouth's line turns down about the jaw's hinge.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, scale, sub};

/// Line of the closed mouth and half its width, cm.
pub const MOUTH_Y: f64 = 4.45;
pub const MOUTH_HALF: f64 = 2.5;
/// Hinge of the jaw (y, z), and its angle with the mouth fully open, degrees.
const HINGE: [f64; 2] = [7.5, 0.4];
const WIDEST: f64 = 17.0;

/// Smooth step from 0 at -1 to 1 at 1.
pub fn rise(at: f64) -> f64 {
    let t = ((at + 1.0) / 2.0).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Share, 0..1, of the jaw's turn that a point of the head takes part in.
pub fn jaw_share([x, y, z]: Vec3) -> f64 {
    // At the lips a step; towards the cheeks ever more gradual.
    let gradual = 0.22 + 0.9 * (x.abs() - 2.1).max(0.0) + 0.5 * (7.5 - z).max(0.0) * rise(x.abs() - 2.5);
    let below = rise((MOUTH_Y - y) / gradual);
    // The nape, the ears and the throat stay.
    below * rise((z - 2.6) / 2.8) * rise((y + 2.2) / 1.6)
}

/// Way of a point from the closed to the fully open mouth when it takes part by `share`, cm.
pub fn opening(at: Vec3, share: f64) -> Vec3 {
    let hinge = [0.0, HINGE[0], HINGE[1]];
    let turned = Rotation::about([1.0, 0.0, 0.0], WIDEST.to_radians()).turn(sub(at, hinge));
    scale(sub(add(turned, hinge), at), share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chin_drops_and_the_upper_face_stays() {
        let way = |at: Vec3| opening(at, jaw_share(at));
        assert!(way([0.0, 1.0, 8.5])[1] < -2.0 && way([0.0, 3.8, 9.5])[1] < -2.2);
        for still in [[0.0, 5.4, 9.5], [3.1, 10.5, 8.5], [0.0, -5.0, 4.0], [7.5, 9.6, 0.0], [0.0, 5.0, -7.0]] {
            assert!(way(still)[1].abs() < 0.02, "{still:?}");
        }
        let cheeks = [6.0, 5.0, 4.4, 4.0, 3.0].map(|y| way([4.0, y, 7.0])[1]);
        assert!(cheeks.windows(2).all(|pair| pair[1] < pair[0]));
    }
}
