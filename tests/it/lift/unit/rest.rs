//! Unit tests of `orator_pipeline::lift::rest`.

use ndarray::Array3;
use ndarray::s;
use orator_base::types::interval::Interval;
use orator_base::types::pose2d::N_HAND;
use orator_base::types::skeleton::{L_HAND, R_HAND};
use orator_pipeline::lift::rest::fill;

#[test]
fn a_hidden_hand_keeps_its_shape_or_mirrors_the_other() {
    let hand = |joints: &mut Array3<f32>, t: usize, root: usize, x: f32| {
        joints.slice_mut(s![t, root..root + N_HAND, ..]).fill(x);
    };
    let mut joints = Array3::from_elem((30, 49, 3), f32::NAN);
    (0..30).for_each(|t| hand(&mut joints, t, R_HAND, 2.0));
    hand(&mut joints, 8, L_HAND, 1.0);
    hand(&mut joints, 29, L_HAND, 5.0);
    let rests = [Interval { start: 0, end: 3 }, Interval { start: 105, end: 112 }, Interval { start: 115, end: 120 }];
    fill(&mut joints.view_mut(), Interval { start: 100, end: 130 }, &rests);
    let left: Vec<String> = (4..21).map(|t| format!("{}", joints[[t, L_HAND + 5, 0]])).collect();
    assert_eq!(left.join(" "), "NaN 1 1 1 1 1 1 1 NaN NaN NaN -2 -2 -2 -2 -2 NaN");
    assert_eq!(joints.slice(s![15, L_HAND + 5, ..]).to_vec(), [-2.0, 2.0, 2.0]);
    assert!(joints[[28, L_HAND, 0]].is_nan() && joints[[29, L_HAND, 0]] == 5.0);
}
