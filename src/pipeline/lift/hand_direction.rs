//! Directions of the hands from the relative depth of a hand model: an input of the body lifter, since a wrist bends
//! little and the hand therefore shows whether the forearm points to the camera.

use super::observed::MAX_PX;
use ndarray::Array3;
use orator_base::motion::upper_body::HandDirections;
use orator_base::types::pose2d::{HAND_VISIBLE_SCORE, Keypoints};

const WRIST: usize = 0;
const KNUCKLES: [usize; 4] = [5, 9, 13, 17];

/// Directions of the right and left hand of a frame; `None` where a hand is missing or has no depth.
pub fn hand_directions(keypoints: &Keypoints, t: usize) -> HandDirections {
    let Some(depth) = &keypoints.hand_depth else { return [None; 2] };
    let of_hand = |points: &Array3<f32>, side: usize| {
        let at = |point: usize| {
            let [x, y, score] = [0, 1, 2].map(|k| points[[t, point, k]]);
            let z = depth[[t, side, point]];
            let is_valid = score >= HAND_VISIBLE_SCORE && [x, y, z].iter().all(|v| v.abs() <= MAX_PX);
            is_valid.then_some([x, y, z])
        };
        let wrist = at(WRIST)?;
        let mut sum = [0.0; 3];
        for knuckle in KNUCKLES {
            let position = at(knuckle)?;
            (0..3).for_each(|k| sum[k] += position[k] - wrist[k]);
        }
        let length = sum.iter().map(|v| v * v).sum::<f32>().sqrt();
        (length > 1e-3).then(|| sum.map(|v| v / length))
    };
    [of_hand(&keypoints.right_hand, 1), of_hand(&keypoints.left_hand, 0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_keypoints::bodies;

    #[test]
    fn a_hand_points_from_wrist_to_knuckles() {
        let mut keypoints = bodies(2, [640, 480], |_| []);
        for point in 0..21 {
            let knuckles = f32::from(u8::from(KNUCKLES.contains(&point)));
            for (k, v) in [300.0 + 30.0 * knuckles, 200.0, 0.9].into_iter().enumerate() {
                keypoints.right_hand[[0, point, k]] = v;
            }
        }
        assert_eq!(hand_directions(&keypoints, 0), [None; 2]);
        let mut depth = Array3::from_elem((2, 2, 21), f32::NAN);
        (0..21).for_each(|point| depth[[0, 1, point]] = if KNUCKLES.contains(&point) { -40.0 } else { 0.0 });
        keypoints.hand_depth = Some(depth);
        assert_eq!(hand_directions(&keypoints, 0), [Some([0.6, 0.0, -0.8]), None]);
        assert_eq!(hand_directions(&keypoints, 1), [None; 2]);
        keypoints.right_hand[[0, 9, 2]] = 0.0;
        assert_eq!(hand_directions(&keypoints, 0), [None; 2]);
    }
}
