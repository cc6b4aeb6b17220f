//! Units of foreign motion.

use ndarray::Array3;
use orator_base::motion::units::{check, is_upside_down};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_ELBOW, L_SHOULDER, L_WRIST, N_JOINTS, R_ELBOW, R_SHOULDER, R_WRIST};
use orator_base::types::time::FrameRate;

/// Arms hanging down, upper arm 0.29, forearm 0.25.
fn standing(n_frames: usize) -> Motion {
    let mut joints = Array3::zeros((n_frames, N_JOINTS, 3));
    for (side, [shoulder, elbow, wrist]) in
        [(1.0, [L_SHOULDER, L_ELBOW, L_WRIST]), (-1.0, [R_SHOULDER, R_ELBOW, R_WRIST])]
    {
        for (joint, y) in [(shoulder, 0.02), (elbow, 0.31), (wrist, 0.56)] {
            joints.slice_mut(ndarray::s![.., joint, 0]).fill(0.18f32 * side);
            joints.slice_mut(ndarray::s![.., joint, 1]).fill(y);
        }
    }
    Motion::from_joints(FrameRate::new(15, 1), joints)
}

#[test]
fn an_implausible_unit_is_named_with_its_factor() {
    let motion = standing(20);
    let times = |by: f32| Motion { joints: &motion.joints * by, ..motion.clone() };
    for by in [0.5, 1.0, 1.6] {
        check(&times(by)).unwrap();
    }
    for (by, unit, metres) in [
        (1000.0, "millimetres", "0.001"),
        (100.0, "centimetres", "0.01"),
        (10.0, "decimetres", "0.1"),
        (39.37, "inches", "0.0254"),
        (3.2808, "feet", "0.3048"),
        (0.1, "metres divided by 10", "10"),
        (0.001, "metres divided by 1000", "1000"),
    ] {
        let text = check(&times(by)).unwrap_err().to_string();
        let advice = format!("seems to be in {unit}; multiply every coordinate by {metres}");
        assert!(text.ends_with(&advice), "{by}: {text}");
    }
    assert!(check(&times(1e6)).unwrap_err().to_string().contains("every known unit"));
    check(&Motion { joints: &motion.joints * f32::NAN, ..motion }).unwrap();
}

#[test]
fn only_arms_above_the_neck_throughout_are_upside_down() {
    let turned = |motion: Motion| Motion { joints: &motion.joints * -1.0, ..motion };
    assert!(is_upside_down(&turned(standing(20))));
    assert!(!is_upside_down(&standing(20)) && !is_upside_down(&turned(standing(10))));
    let mut raised = turned(standing(100));
    raised.joints.slice_mut(ndarray::s![..3, R_WRIST, 1]).fill(0.1);
    assert!(!is_upside_down(&raised));
}
