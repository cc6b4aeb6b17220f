//! Interpolation of keypoints between frames: linear where both neighbouring frames show the point, else the value of
//! the nearer frame if that shows it.

use orator_base::types::pose2d::Keypoint;
use orator_formats::keypoints::FoundPerson;

/// Distance in frames within which a time counts as that of a frame.
const EPSILON: f64 = 1e-4;

/// Interpolates the person at the fractional frame index `frame_idx`; `None` where the neighbouring frames show nobody.
pub fn person_at(frames: &[Option<&FoundPerson>], frame_idx: f64) -> Option<FoundPerson> {
    let at = |frame: usize| frames.get(frame).copied().flatten();
    let below = frame_idx.max(0.0) as usize;
    let share = frame_idx - below as f64;
    match (at(below), at(below + 1)) {
        (before, _) if share < EPSILON => before.cloned(),
        (_, after) if share > 1.0 - EPSILON => after.cloned(),
        (None, None) => None,
        (before, after) => {
            let none = FoundPerson::default();
            let (before, after) = (before.unwrap_or(&none), after.unwrap_or(&none));
            let share = share as f32;
            Some(FoundPerson {
                body: std::array::from_fn(|k| interpolate(before.body[k], after.body[k], share)),
                left_hand: std::array::from_fn(|k| interpolate(before.left_hand[k], after.left_hand[k], share)),
                right_hand: std::array::from_fn(|k| interpolate(before.right_hand[k], after.right_hand[k], share)),
            })
        }
    }
}

fn interpolate(a: Keypoint, b: Keypoint, share: f32) -> Keypoint {
    let lerp = |a: f32, b: f32| a + share * (b - a);
    match (a.score > 0.0, b.score > 0.0) {
        (true, true) => Keypoint { x: lerp(a.x, b.x), y: lerp(a.y, b.y), score: lerp(a.score, b.score) },
        (true, false) if share <= 0.5 => a,
        (false, true) if share > 0.5 => b,
        _ => Keypoint::default(),
    }
}
