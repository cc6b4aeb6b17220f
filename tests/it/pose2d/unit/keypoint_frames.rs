//! Unit tests of `orator_pipeline::pose2d::span::keypoint_frames`.

use orator_base::types::pose2d::{FaceMeasurement, Keypoint, Pose2d};
use orator_base::types::time::FrameRate;
use orator_pipeline::pose2d::span::keypoint_frames::KeypointFrames;

#[test]
fn frames_become_arrays() {
    let mut gathered = KeypointFrames::default();
    let mut pose = Pose2d { n_persons: 2, identity: 3, ..Pose2d::default() };
    gathered.push(pose.clone(), 0.0);
    pose.right_hand[20] = Keypoint { x: 5.0, y: 6.0, score: 0.5 };
    pose.person.height = 9.0;
    pose.face = Some(FaceMeasurement { score: 0.9, opening: 0.2 });
    gathered.push(pose, 0.07);
    assert_eq!(gathered.share(|pose| pose.face.is_some()), 0.5);
    let (keypoints, extras) = gathered.finish(FrameRate::new(15, 1), [64, 48]).unwrap();
    assert_eq!((keypoints.n_frames(), keypoints.right_hand[[1, 20, 1]], keypoints.body[[1, 0, 0]]), (2, 6.0, 0.0));
    assert_eq!((extras.person[[1, 3]], extras.n_persons[0], extras.time_secs[1]), (9.0, 2, 0.07));
    assert_eq!(extras.identity[1], 3);
    let face = extras.face.unwrap();
    assert_eq!((face.opening[0].is_nan(), face.opening[1], face.score[0]), (true, 0.2, 0.0));
}
