//! What was lifted and what was not, in sentences for the user.

use super::lifter::{Lifted, MAX_GAP_SECS};
use orator_base::types::pose2d::{Keypoints, SEEN_SCORE, coco};

/// Why joints are missing (NaN), in a sentence; nothing when all are there.
pub fn notes(keypoints: &Keypoints, lifted: &Lifted) -> Option<String> {
    let n_frames = keypoints.n_frames();
    let unseen = |j: usize| {
        let scores = keypoints.body.slice(ndarray::s![.., j, 2]);
        scores.iter().filter(|score| score.is_nan() || **score < SEEN_SCORE).count()
    };
    (lifted.n_frames < n_frames).then(|| {
        format!(
            "no body in {} of {n_frames} frames (NaN): it is lifted where both shoulders are seen within {MAX_GAP_SECS} s; \
             the right shoulder is not seen in {} frames, the left in {}",
            n_frames - lifted.n_frames,
            unseen(coco::R_SHOULDER),
            unseen(coco::L_SHOULDER)
        )
    })
}
