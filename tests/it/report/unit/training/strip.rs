//! Tests of `orator_report::training::strip`.

use ndarray::Array3;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;
use orator_report::training::strip::{HeldOutPair, PAIR_PX, WIDTH, strip};

#[test]
fn any_length_is_drawn() {
    let motion = |n_frames: usize, shift: f32| {
        let position =
            |(t, joint, k): (usize, usize, usize)| (t as f32 * 0.01 + joint as f32 * 0.01 + shift) * k as f32;
        Motion::from_joints(FrameRate::new(15, 1), Array3::from_shape_fn((n_frames, N_JOINTS, 3), position))
    };
    for (n_ground_truth, n_predicted) in [(0, 3), (1, 1), (3, 5), (90, 89)] {
        let pair = HeldOutPair {
            name: "a".to_owned(),
            start_secs: 0.0,
            ground_truth: motion(n_ground_truth, 0.0),
            predicted: motion(n_predicted, 0.1),
        };
        let image = strip(&[pair]).unwrap();
        assert_eq!((image.width, image.height), (WIDTH, PAIR_PX));
        assert!(image.data.iter().any(|v| *v < 100), "{n_ground_truth}");
    }
    assert_eq!(strip(&[]).unwrap().height, 1);
}
