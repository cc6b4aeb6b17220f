//! Tests of `orator_avatar::animate::solve::roll`.

use orator_avatar::animate::solve::roll::{REST, smoothed_rolls, upper_arm_rotations};
use orator_base::math::vec3::{dot, unit};

#[test]
fn measured_rolls_are_kept_and_gaps_are_interpolated() {
    let measured: Vec<[f64; 2]> =
        (0..40).map(|t| if (10..30).contains(&t) { [9.0, 0.0] } else { [f64::from(t / 20), 1.0] }).collect();
    let rolls = smoothed_rolls(&measured);
    assert!(rolls[0].abs() < 1e-3 && (rolls[39] - 1.0).abs() < 1e-3);
    assert!(rolls.windows(2).all(|pair| (-1e-9..0.06).contains(&(pair[1] - pair[0]))), "{rolls:?}");
    assert!((rolls[19] + rolls[20] - 1.0).abs() < 1e-4);
    assert_eq!(smoothed_rolls(&[]), Vec::<f64>::new());
    assert!(smoothed_rolls(&[[3.0, 0.0]; 5]).iter().all(|roll| roll.abs() < 1e-6));
}

#[test]
fn the_elbow_bends_about_its_axis() {
    let upper = vec![unit([0.3, -0.9, 0.1], 0.0); 20];
    let forearm = vec![unit([0.2, 0.1, 0.9], 0.0); 20];
    for rotation in upper_arm_rotations(&upper, &forearm) {
        let rotation = rotation.unwrap();
        assert!(dot(rotation.turn(REST.0), upper[0].unwrap()) > 1.0 - 1e-9);
        let into = rotation.inverse().turn(forearm[0].unwrap());
        assert!(into[1].abs() < 1e-4 && into[2] > 0.0, "{into:?}");
    }
}
