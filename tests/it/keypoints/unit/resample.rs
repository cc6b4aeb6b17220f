//! Unit tests of `orator_pipeline::keypoints::resample`.

use orator_base::types::pose2d::Keypoint;
use orator_formats::keypoints::FoundPerson;
use orator_pipeline::keypoints::resample::person_at;

fn person(x: f32) -> FoundPerson {
    let mut person = FoundPerson::default();
    person.body[0] = Keypoint { x, y: -x, score: 0.5 };
    person
}

#[test]
fn a_point_in_one_frame_only_is_used_up_to_the_midpoint() {
    let (shown, hidden) = (person(4.0), FoundPerson::default());
    let frames = [Some(&shown), Some(&hidden), None, Some(&shown)];
    let score = |frame_idx: f64| person_at(&frames, frame_idx).map(|person| person.body[0].score);
    assert_eq!([0.3, 0.7, 1.0, 1.5].map(score), [Some(0.5), Some(0.0), Some(0.0), Some(0.0)]);
    assert_eq!((score(2.0), score(2.3), score(2.7), score(3.0)), (None, Some(0.0), Some(0.5), Some(0.5)));
}
