//! Accumulates the keypoints of a video frame by frame.

use anyhow::Result;
use ndarray::{Array1, Array2, Array3};
use orator_base::types::pose2d::{FaceMeasurement, Keypoint, Keypoints, N_BODY, N_HAND, PersonBox, Pose2d};
use orator_base::types::time::FrameRate;
use orator_formats::keypoints_npz::{Extras, FaceFrames};
use serde::{Deserialize, Serialize};

/// Frames so far, about 1 kB each, with the times of their source frames in seconds.
#[derive(Default, Serialize, Deserialize)]
pub struct KeypointFrames(Vec<(Pose2d, f64)>);

impl KeypointFrames {
    pub fn push(&mut self, pose: Pose2d, source_secs: f64) {
        self.0.push((pose, source_secs));
    }

    /// Adds the frames of the following part; `n_before` is added to their identities.
    pub fn append(&mut self, next: Self, n_before: i64) {
        let renumbered = |pose: Pose2d| Pose2d { identity: pose.identity.saturating_add(n_before), ..pose };
        self.0.extend(next.0.into_iter().map(|(pose, secs)| (renumbered(pose), secs)));
    }

    pub fn n_frames(&self) -> usize {
        self.0.len()
    }

    /// Share of the frames that satisfy `holds`.
    pub fn share(&self, holds: impl Fn(&Pose2d) -> bool) -> f64 {
        self.0.iter().filter(|(pose, _)| holds(pose)).count() as f64 / self.n_frames().max(1) as f64
    }

    /// Keypoints of the complete video, and the extra arrays of `keypoints.npz`.
    ///
    /// # Errors
    /// Arrays of unequal lengths.
    pub fn finish(self, fps: FrameRate, image_size: [u32; 2]) -> Result<(Keypoints, Extras)> {
        let n_frames = self.n_frames();
        let poses = || self.0.iter().map(|(pose, _)| pose);
        let points = |part: fn(&Pose2d) -> &[Keypoint], n: usize| {
            let numbers = poses().flat_map(part).flat_map(|point| [point.x, point.y, point.score]);
            Array3::from_shape_vec((n_frames, n, 3), numbers.collect())
        };
        let has_depth = poses().any(|pose| pose.hand_depth.iter().any(Option::is_some));
        let depths = || poses().flat_map(|pose| pose.hand_depth).flat_map(|hand| hand.unwrap_or([f32::NAN; N_HAND]));
        let hand_depth = has_depth.then(|| Array3::from_shape_vec((n_frames, 2, N_HAND), depths().collect()));
        let keypoints = Keypoints {
            hand_depth: hand_depth.transpose()?,
            fps,
            image_size,
            body: points(|pose| &pose.body, N_BODY)?,
            left_hand: points(|pose| &pose.left_hand, N_HAND)?,
            right_hand: points(|pose| &pose.right_hand, N_HAND)?,
        };
        let of_face = |part: fn(&FaceMeasurement) -> f32, missing: f32| {
            poses().map(|pose| pose.face.as_ref().map_or(missing, part)).collect::<Array1<f32>>()
        };
        let face = poses().any(|pose| pose.face.is_some()).then(|| FaceFrames {
            opening: of_face(|face| face.opening, f32::NAN),
            score: of_face(|face| face.score, 0.0),
        });
        let numbers = |PersonBox { x, y, width, height, score }: PersonBox| [x, y, width, height, score];
        let extras = Extras {
            time_secs: self.0.iter().map(|(_, secs)| *secs).collect(),
            person: Array2::from_shape_vec((n_frames, 5), poses().flat_map(|pose| numbers(pose.person)).collect())?,
            n_persons: poses().map(|pose| i64::from(pose.n_persons)).collect(),
            identity: poses().map(|pose| pose.identity).collect(),
            other_hand: Array2::from_shape_vec((n_frames, 2), poses().flat_map(|pose| pose.other_hand).collect())?,
            face,
        };
        Ok((keypoints, extras))
    }
}
