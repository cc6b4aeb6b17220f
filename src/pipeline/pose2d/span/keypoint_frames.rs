//! The keypoints of a video as they are gathered, frame by frame.

use anyhow::Result;
use ndarray::{Array1, Array2, Array3};
use orator_base::types::pose2d::{FaceSeen, Keypoint, Keypoints, N_BODY, N_HAND, PersonBox, Pose2d};
use orator_base::types::time::FrameRate;
use orator_formats::keypoints_npz::{Extras, FaceFrames};
use serde::{Deserialize, Serialize};

/// What was seen so far: plain numbers, 1 kB a frame.
#[derive(Default, Serialize, Deserialize)]
pub struct KeypointFrames {
    body: Vec<f32>,
    left_hand: Vec<f32>,
    right_hand: Vec<f32>,
    person: Vec<f32>,
    n_people: Vec<i64>,
    identity: Vec<i64>,
    other_hand: Vec<bool>,
    face: Vec<Option<FaceSeen>>,
    time_secs: Vec<f64>,
}

impl KeypointFrames {
    /// Takes in one frame and the time of the source frame it shows.
    pub fn push(&mut self, pose: &Pose2d, source_secs: f64) {
        let numbers = |points: &[Keypoint]| points.iter().flat_map(|p| [p.x, p.y, p.score]).collect::<Vec<_>>();
        self.body.extend(numbers(&pose.body));
        self.left_hand.extend(numbers(&pose.left_hand));
        self.right_hand.extend(numbers(&pose.right_hand));
        let PersonBox { x, y, width, height, score } = pose.person;
        self.person.extend([x, y, width, height, score]);
        self.n_people.push(i64::from(pose.n_people));
        self.identity.push(pose.identity);
        self.other_hand.extend(pose.other_hand);
        self.face.push(pose.face);
        self.time_secs.push(source_secs);
    }

    /// Adds the frames that follow, whose first person has the number `n_before`.
    pub fn append(&mut self, next: Self, n_before: i64) {
        self.body.extend(next.body);
        self.left_hand.extend(next.left_hand);
        self.right_hand.extend(next.right_hand);
        self.person.extend(next.person);
        self.n_people.extend(next.n_people);
        self.identity.extend(next.identity.into_iter().map(|identity| identity.saturating_add(n_before)));
        self.other_hand.extend(next.other_hand);
        self.face.extend(next.face);
        self.time_secs.extend(next.time_secs);
    }

    /// Number of frames T.
    pub fn n_frames(&self) -> usize {
        self.time_secs.len()
    }

    /// The whole video's keypoints, and what stands beside them in the file.
    pub fn finish(self, fps: FrameRate, image_size: [u32; 2]) -> Result<(Keypoints, Extras)> {
        let n_frames = self.n_frames();
        let points = |numbers: Vec<f32>, n: usize| Array3::from_shape_vec((n_frames, n, 3), numbers);
        let keypoints = Keypoints {
            fps,
            image_size,
            body: points(self.body, N_BODY)?,
            left_hand: points(self.left_hand, N_HAND)?,
            right_hand: points(self.right_hand, N_HAND)?,
        };
        let of_face = |part: fn(&FaceSeen) -> f32, unseen: f32| {
            self.face.iter().map(|face| face.as_ref().map_or(unseen, part)).collect::<Array1<f32>>()
        };
        let is_seen = self.face.iter().any(Option::is_some);
        let face = is_seen.then(|| FaceFrames {
            opening: of_face(|face| face.opening, f32::NAN),
            score: of_face(|face| face.score, 0.0),
        });
        let extras = Extras {
            time_secs: Array1::from(self.time_secs),
            person: Array2::from_shape_vec((n_frames, 5), self.person)?,
            n_people: Array1::from(self.n_people),
            identity: Array1::from(self.identity),
            other_hand: Array2::from_shape_vec((n_frames, 2), self.other_hand)?,
            face,
        };
        Ok((keypoints, extras))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_become_arrays() {
        let mut gathered = KeypointFrames::default();
        let mut pose = Pose2d { n_people: 2, identity: 3, ..Pose2d::default() };
        gathered.push(&pose, 0.0);
        pose.right_hand[20] = Keypoint { x: 5.0, y: 6.0, score: 0.5 };
        pose.person.height = 9.0;
        pose.face = Some(FaceSeen { score: 0.9, opening: 0.2 });
        gathered.push(&pose, 0.07);
        let (keypoints, extras) = gathered.finish(FrameRate::new(15, 1), [64, 48]).unwrap();
        assert_eq!((keypoints.n_frames(), keypoints.right_hand[[1, 20, 1]], keypoints.body[[1, 0, 0]]), (2, 6.0, 0.0));
        assert_eq!((extras.person[[1, 3]], extras.n_people[0], extras.time_secs[1]), (9.0, 2, 0.07));
        assert_eq!(extras.identity[1], 3);
        let face = extras.face.unwrap();
        assert_eq!((face.opening[0].is_nan(), face.opening[1], face.score[0]), (true, 0.2, 0.0));
    }
}
