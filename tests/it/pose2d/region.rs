//! Regions of an image for a model.

use orator_media::opencv::warp::Region;
use orator_pipeline::pose2d::region::{are_similar, around_hand, around_palm, beyond_wrist};
use std::f64::consts::PI;

#[test]
fn an_upright_hand_has_no_rotation_and_a_turned_one_has() {
    let hand: [[f64; 2]; 21] = std::array::from_fn(|at| [100.0 + (at / 4) as f64 * 8.0, 200.0 - at as f64 * 3.0]);
    let turn = |angle: f64, [x, y]: [f64; 2]| {
        let (sin, cos) = angle.sin_cos();
        [cos * x - sin * y, sin * x + cos * y]
    };
    let plain = around_hand(&hand);
    let turned = around_hand(&hand.map(|point| turn(0.8, point)));
    assert!((turned.rotation - plain.rotation - 0.8).abs() < 1e-9 && (turned.side - plain.side).abs() < 20.0);
    let arm = beyond_wrist([0.0, 100.0], [0.0, 50.0], 100.0);
    assert!(arm.rotation.abs() < 1e-6 && (arm.centre[1] - (50.0 - 13.5)).abs() < 1e-6 && arm.side == 80.0);
    let palm = around_palm([0.0, 0.0], [20.0, 20.0], [10.0, 10.0], [20.0, 10.0]);
    assert!((palm.rotation - PI / 2.0).abs() < 1e-9 && (palm.centre[0] - 20.0).abs() < 1e-9);
}

#[test]
fn squares_are_similar_by_centre_side_and_rotation() {
    let square = |x: f64, side: f64, rotation: f64| Region { centre: [x, 0.0], side, rotation };
    let one = square(0.0, 100.0, 3.1);
    assert!(are_similar(&one, &square(5.0, 110.0, -3.1)));
    assert!(!are_similar(&one, &square(15.0, 100.0, 3.1)) && !are_similar(&one, &square(0.0, 60.0, 3.1)));
    assert!(!are_similar(&one, &square(0.0, 100.0, 2.5)) && !are_similar(&one, &square(f64::NAN, 100.0, 3.1)));
}

#[test]
fn degenerate_input_gives_no_transform() {
    assert_eq!(around_hand(&[[f64::NAN; 2]; 21]).src_from_dst(224), None);
    assert_eq!(around_hand(&[[3.0; 2]; 21]).src_from_dst(224), None);
    assert_eq!(beyond_wrist([1.0; 2], [1.0; 2], 0.0).src_from_dst(224), None);
}
