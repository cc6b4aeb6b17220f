//! Synthetic keypoints for unit tests.

use ndarray::{Array3, arr1, s};
use orator_base::types::pose2d::Keypoints;
use orator_base::types::time::FrameRate;

/// Keypoints at 15 fps; `at` gives the body points (COCO index, x, y) of each frame. Without hands.
pub(crate) fn bodies<const N: usize>(
    n_frames: usize,
    image_size: [u32; 2],
    at: impl Fn(usize) -> [(usize, f32, f32); N],
) -> Keypoints {
    let mut body = Array3::zeros((n_frames, 17, 3));
    for t in 0..n_frames {
        for (point, x, y) in at(t) {
            body.slice_mut(s![t, point, ..]).assign(&arr1(&[x, y, 0.9]));
        }
    }
    let hand = Array3::zeros((n_frames, 21, 3));
    Keypoints {
        fps: FrameRate::new(15, 1),
        image_size,
        body,
        left_hand: hand.clone(),
        right_hand: hand,
        hand_depth: None,
    }
}
