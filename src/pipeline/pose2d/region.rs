//! Hand regions: the rotated square to search for a hand, from its points in the previous frame, from the arm, or from
//! a palm. Constants are those of MediaPipe (hand_landmark_landmarks_to_roi, palm_detection_detection_to_roi); those
//! for the arm were measured on its output.

use orator_media::opencv::warp::Region;
use std::f64::consts::{PI, TAU};

/// Stable points of a hand: wrist, thumb up to its first joint, and the two lower joints of each finger.
const STABLE_POINTS: [usize; 12] = [0, 1, 2, 3, 5, 6, 9, 10, 13, 14, 17, 18];

/// Square around a hand with 21 known points.
pub fn around_hand(points: &[[f64; 2]; 21]) -> Region {
    let half = |a: [f64; 2], b: [f64; 2]| [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0];
    let knuckles = half(half(points[5], points[13]), points[9]);
    let rotation = upright([knuckles[0] - points[0][0], knuckles[1] - points[0][1]]);
    let stable = STABLE_POINTS.map(|at| points[at]);
    let (low, high) = extent(&stable);
    let centre = half(low, high);
    let (sin, cos) = rotation.sin_cos();
    let turned = stable.map(|[x, y]| {
        let (x, y) = (x - centre[0], y - centre[1]);
        [x * cos + y * sin, y * cos - x * sin]
    });
    let (low, high) = extent(&turned);
    let (width, height) = (high[0] - low[0], high[1] - low[1]);
    let [x, y] = half(low, high);
    let y = y - 0.1 * height;
    Region {
        centre: [centre[0] + x * cos - y * sin, centre[1] + x * sin + y * cos],
        side: width.max(height) * 2.0,
        rotation,
    }
}

/// Square in which the hand of an arm is expected.
pub fn beyond_wrist(elbow: [f64; 2], wrist: [f64; 2], shoulder_px: f64) -> Region {
    let along = [wrist[0] - elbow[0], wrist[1] - elbow[1]];
    let length = along[0].hypot(along[1]);
    let unit = along.map(|part| part / (length + 1e-6));
    let offset = 0.27 * length.max(0.45 * shoulder_px);
    Region {
        centre: [wrist[0] + unit[0] * offset, wrist[1] + unit[1] * offset],
        side: 0.8 * shoulder_px,
        rotation: upright(unit),
    }
}

/// Whether two squares are so similar that a second inference adds nothing: centres within a tenth of the side, sides
/// within a fifth, rotations within 20 degrees.
pub fn are_similar(a: &Region, b: &Region) -> bool {
    let away = (a.centre[0] - b.centre[0]).hypot(a.centre[1] - b.centre[1]);
    let turned = (a.rotation - b.rotation).rem_euclid(TAU);
    away < 0.1 * b.side && (a.side - b.side).abs() < 0.2 * b.side && turned.min(TAU - turned) < PI / 9.0
}

/// Square around the hand of a detected palm, from the corners of its box, its wrist and the base of its middle finger.
pub fn around_palm(low: [f64; 2], high: [f64; 2], wrist: [f64; 2], middle: [f64; 2]) -> Region {
    let (width, height) = (high[0] - low[0], high[1] - low[1]);
    let rotation = upright([middle[0] - wrist[0], middle[1] - wrist[1]]);
    let (sin, cos) = rotation.sin_cos();
    Region {
        centre: [(low[0] + high[0]) / 2.0 + 0.5 * height * sin, (low[1] + high[1]) / 2.0 - 0.5 * height * cos],
        side: width.max(height) * 2.6,
        rotation,
    }
}

/// Rotation that makes `direction` point up in the crop, -pi..pi.
fn upright([x, y]: [f64; 2]) -> f64 {
    let angle = PI / 2.0 - (-y).atan2(x);
    angle - TAU * ((angle + PI) / TAU).floor()
}

fn extent(points: &[[f64; 2]]) -> ([f64; 2], [f64; 2]) {
    points.iter().fold(([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]), |(low, high), [x, y]| {
        ([low[0].min(*x), low[1].min(*y)], [high[0].max(*x), high[1].max(*y)])
    })
}
