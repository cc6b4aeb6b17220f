//! The pipeline as a value (`pipeline`, run by `run`, looked at by `status`), its five stages, the `sound` of its videos, whose
//! voice it is by the `lips`, a `portrait` of the person, and one `claimed_video` of a worker among many. The stages never
//! import each other: they meet in the files that they write. `keypoints` stands in for the first two where other programs looked at the pictures.

pub mod account;
pub mod claimed_video;
pub mod dataset;
pub mod extract;
pub mod keypoints;
pub mod lift;
pub mod lips;
pub mod pipeline;
pub mod portrait;
pub mod pose2d;
pub mod process;
pub mod run;
pub mod segment;
pub mod sound;
pub mod stages;
pub mod status;
pub mod timing;

pub use account::{AccountKind, TimeAccount};
pub use pipeline::Pipeline;
pub use run::{RunReport, RunState, Selection, StageCounts, UnitFailure, UnitReport};
pub use status::{StagePlan, StatusReport, UnitState, UnitStatus};

#[cfg(test)]
mod test_keypoints {
    use ndarray::{Array3, arr1, s};
    use orator_base::types::pose2d::Keypoints;
    use orator_base::types::time::FrameRate;

    /// Keypoints at 15 frames a second whose body points (COCO point, x, y) are those that `at` gives of each frame; no hands.
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
        Keypoints { fps: FrameRate::new(15, 1), image_size, body, left_hand: hand.clone(), right_hand: hand }
    }
}
