//! Skeletons in the authors' text format.

use ndarray::Array3;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{N_JOINTS, NECK};
use orator_base::types::time::FrameRate;
use orator_formats::authors_txt::{format, parse};

const FPS: FrameRate = FrameRate::new(15, 1);

#[test]
fn motion_round_trips_with_fingers_tip_first() {
    let mut joints = Array3::from_shape_fn((3, N_JOINTS, 3), |(t, j, k)| (t * 147 + j * 3 + k) as f32 * 0.37e-3);
    joints.slice_mut(ndarray::s![.., NECK, ..]).fill(0.0);
    joints.slice_mut(ndarray::s![1, 30, ..]).fill(f32::NAN);
    let motion = Motion::from_joints(FPS, joints);
    let text = format(&motion);
    let again = parse(&text, FPS).unwrap();
    assert!(again.joints.iter().zip(&motion.joints).all(|(a, b)| a == b || (a.is_nan() && b.is_nan())));
    assert_eq!(again.mask, motion.mask);
    // The left thumb tip, joint 11 in memory, is the authors' joint 8.
    let numbers: Vec<f32> = text.lines().next().unwrap().split(' ').map(|w| w.parse().unwrap()).collect();
    assert_eq!(numbers[24], motion.joints[[0, 11, 0]]);
}

#[test]
fn errors_name_the_line() {
    let line = vec!["0.5"; 144].join(" ");
    let good = format!("0 0 0 {line}\n");
    let error_of = |text: &str| format!("{:#}", parse(text, FPS).unwrap_err());
    assert!(error_of(&format!("{good}{good}0 0 0 1\n")).contains("line 3: 4 numbers, expected 147"));
    assert!(error_of(&format!("{good}0 0 zero {line}\n")).contains("line 2, column 3: `zero`"));
    assert!(error_of(&format!("1 0 0 {line}\n")).contains("line 1: the first joint"));
    assert!(error_of("\n\n").contains("no frames"));
}
