//! Normalisation of the features of motion.

use ndarray::{Array2, Array3};
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::{Posture, PostureChannel};
use orator_base::types::skeleton::{L_HAND, L_WRIST, N_BONES, N_JOINTS, NECK, R_HAND, R_WRIST};
use orator_base::types::time::FrameRate;
use orator_gesture::generate::normalisation::{ChannelNormalisation, Normalisation};

#[test]
fn features_round_trip() {
    let value = |t: usize, joint: usize, k: usize| (t + 3 * joint + 7 * k) as f32 * 0.01;
    let mut joints = Array3::from_shape_fn((5, N_JOINTS, 3), |(t, joint, k)| value(t, joint, k));
    for t in 0..5 {
        for k in 0..3 {
            joints[[t, NECK, k]] = 0.0;
            joints[[t, L_HAND, k]] = joints[[t, L_WRIST, k]];
            joints[[t, R_HAND, k]] = joints[[t, R_WRIST, k]];
        }
    }
    let whole = joints.clone();
    joints[[2, 5, 1]] = f32::NAN;
    let mut motion = Motion::from_joints(FrameRate::new(15, 1), joints);
    motion.mask[[3, 9]] = false;
    let table = |value| Array2::from_elem((N_JOINTS, 3), value);
    let normal = Normalisation::new(&table(0.1), &table(0.0), vec![0.0; N_BONES]);
    normal.check().unwrap();
    let (features, mask) = normal.features(&motion);
    assert_eq!((features[[12, 2]], features[[13, 2]]), (0.0, 0.0));
    assert_eq!((mask[[4, 2]], mask[[8, 3]], mask[[8, 2]], mask[[L_HAND - 1, 0]]), (false, false, true, false));
    let back = normal.joints(features.view());
    for ((t, joint, k), expected) in whole.indexed_iter() {
        if (t, joint) != (2, 5) {
            assert!((back[[t, joint, k]] - expected).abs() < 1e-5);
        }
    }
}

#[test]
fn channels_round_trip_with_masks() {
    let table = |value| Array2::from_elem((N_JOINTS, 3), value);
    let mut normal = Normalisation::new(&table(0.1), &table(0.2), vec![0.0; N_BONES]);
    let motion = Motion::from_joints(FrameRate::new(15, 1), Array3::from_elem((5, N_JOINTS, 3), 0.1));
    let mut posture = Posture::missing(5);
    posture.trunk = Array2::from_shape_fn((5, 3), |(t, k)| 0.1 * t as f32 - 0.2 * k as f32);
    posture.trunk[[2, 1]] = f32::NAN;
    assert_eq!(normal.features_with_channels(&motion, Some(&posture)), normal.features(&motion));
    assert_eq!(normal.posture(normal.features(&motion).0.view()), None);

    let (head, trunk) = (PostureChannel::Head, PostureChannel::Trunk);
    normal.channels = vec![
        ChannelNormalisation::new(head, [9; 3], [0.0; 3], [0.0; 3]),
        ChannelNormalisation::new(trunk, [9, 9, 0], [0.1, 0.2, 0.0], [0.2, 0.1, 0.0]),
    ];
    normal.check().unwrap();
    let (features, mask) = normal.features_with_channels(&motion, Some(&posture));
    assert_eq!((features.dim(), mask.dim(), normal.n_features()), ((150, 5), (54, 5), 150));
    // The head is not visible here, and the roll of the trunk was never visible in training.
    assert!([48, 49, 50, 53].iter().all(|row| mask.row(*row).iter().all(|seen| !seen)));
    assert_eq!(mask.row(51).to_vec(), [true; 5]);
    assert_eq!(mask.row(52).to_vec(), [true, true, false, true, true]);
    assert!(features.iter().all(|v| v.is_finite()) && features[[148, 2]] == 0.0);
    let back = normal.posture(features.view()).unwrap();
    for t in [0, 1, 3, 4] {
        for k in 0..2 {
            assert!((back.trunk[[t, k]] - posture.trunk[[t, k]]).abs() < 1e-6);
        }
        assert!(back.trunk[[t, 2]].is_nan());
    }
    let (none, unseen) = normal.features_with_channels(&motion, None);
    assert!(none.row(149).iter().all(|v| *v == 0.0) && unseen.row(51).iter().all(|seen| !seen));
    normal.channels.reverse();
    assert!(normal.check().is_err());
}
