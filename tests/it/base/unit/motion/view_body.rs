//! Tests of `orator_base::motion::view::body`.

use orator_base::motion::upper_body::BodyPoints;
use orator_base::motion::view::body::at;

#[test]
fn points_between_two_frames_are_interpolated() {
    let frames: Vec<BodyPoints> = vec![[Some([0.0, 4.0]); 9], [Some([2.0, 8.0]); 9], [None; 9]];
    assert_eq!(at(&frames, 0.25)[0], Some([0.5, 5.0]));
    assert_eq!((at(&frames, 1.4)[0], at(&frames, 1.6)[0]), (Some([2.0, 8.0]), None));
}
