//! Known truth under noise: hands are fitted to all of their points, noise does not lengthen bones, and wrists keep their
//! positions if the shoulders move.

use orator_avatar::animate::Smoothing;
use orator_avatar::animate::rig::rig::bone_metres;
use orator_avatar::animate::solve::hand_fit::with_fitted_hands;
use orator_avatar::animate::solve::positions::JointPositions;
use orator_avatar::animate::solve::reach::reach;
use orator_avatar::animate::solve::smoothing::Filter;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, norm, scale, sub, unit};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_ELBOW, L_HAND, L_SHOULDER, L_WRIST, N_HAND_JOINTS, N_JOINTS, R_HAND, R_WRIST};
use orator_base::types::time::FrameRate;

/// Lengths of clavicle, upper arm and forearm.
const METRES: [f64; 3] = [0.16, 0.28, 0.25];

/// Distance of the left wrist from its observed position, metres, by frame, for shoulders that move in and out.
fn distances(along: Vec3, fore: Vec3, metres: [f64; 3]) -> Vec<f64> {
    let [along, fore] = [along, fore].map(|v| unit(v, 0.0).unwrap());
    let mut joints = ndarray::Array3::<f32>::zeros((61, N_JOINTS, 3));
    let mut wrists = Vec::new();
    for (t, mut frame) in joints.outer_iter_mut().enumerate() {
        let shoulder = [METRES[0] + 0.01 * (0.1 * (t as f64 - 30.0)).sin(), 0.0, 0.0];
        let elbow = add(shoulder, scale(along, METRES[1]));
        let wrist = add(elbow, scale(fore, METRES[2]));
        wrists.push(wrist);
        for (joint, [x, y, z]) in [(L_SHOULDER, shoulder), (L_ELBOW, elbow), (L_WRIST, wrist)] {
            (0..3).for_each(|k| frame[[joint, k]] = [x, -y, -z][k] as f32);
        }
    }
    let positions = JointPositions::from_motion(&Motion::from_joints(FrameRate::new(30, 1), joints));
    let rest = vec![Rotation::IDENTITY; 61];
    let (mut upper, mut lower) = (vec![Some(along); 61], vec![Some(fore); 61]);
    reach(&positions, metres, (&rest, &rest), &Filter::None, (&mut upper, &mut lower));
    let reached = |(upper, lower): (&Option<Vec3>, &Option<Vec3>)| {
        add([METRES[0], 0.0, 0.0], add(scale(upper.unwrap(), METRES[1]), scale(lower.unwrap(), METRES[2])))
    };
    let reached = upper.iter().zip(&lower).map(reached);
    reached.zip(wrists).map(|(reached, wrist)| norm(sub(reached, wrist))).collect()
}

#[test]
fn a_bent_arm_reaches_and_other_arms_keep_their_directions() {
    let worst = |distances: Vec<f64>| distances.into_iter().fold(0.0, f64::max);
    let (down, ahead) = ([0.2, -0.9, 0.1], [-0.1, 0.1, 0.9]);
    assert!(worst(distances(down, ahead, METRES)) < 1e-6);
    // The forearm of a nearly straight arm points to the wrist, but its elbow does not move.
    assert!((0.001..0.012).contains(&worst(distances(down, [0.22, -0.9, 0.1], METRES))));
    // The rig has other bones.
    assert!(worst(distances(down, ahead, [0.16, 0.32, 0.25])) > 0.009);
}

/// Both hands turn about the vertical while the fingers bend slowly; `noise` metres of white noise in every point.
fn turning(noise: f64) -> Motion {
    let mut state = 1u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1u32 << 31) - 0.5
    };
    let mut joints = ndarray::Array3::<f32>::zeros((90, N_JOINTS, 3));
    for (t, mut frame) in joints.outer_iter_mut().enumerate() {
        let secs = t as f64 / 30.0;
        let turn = Rotation::about([0.0, 1.0, 0.0], 1.5 * (4.0 * secs).sin());
        for point in 0..N_HAND_JOINTS {
            let (finger, bone) = ((point.max(1) - 1) / 4, (point.max(1) - 1) % 4);
            let along = if point == 0 { 0.0 } else { 0.08 + 0.03 * bone as f64 };
            let bend = 0.01 * bone as f64 * (1.0 + secs.sin());
            let at = turn.turn([along, -bend, 0.03 - 0.02 * finger as f64]);
            let at = if point == 0 { [0.0; 3] } else { at };
            for (root, sign) in [(L_HAND, 1.0), (R_HAND, -1.0)] {
                let error = [0, 1, 2].map(|_| noise * (0..12).map(|_| uniform()).sum::<f64>());
                let [x, y, z] = add(at, error);
                let at = [sign * (0.3 + x), -y, -z];
                (0..3).for_each(|k| frame[[root + point, k]] = at[k] as f32);
            }
        }
        for (wrist, root) in [(L_WRIST, L_HAND), (R_WRIST, R_HAND)] {
            (0..3).for_each(|k| frame[[wrist, k]] = frame[[root, k]]);
        }
    }
    Motion::from_joints(FrameRate::new(30, 1), joints)
}

/// Mean distance of the points of both hands, metres.
fn distance(a: &JointPositions, b: &JointPositions) -> f64 {
    let hands = |a: &JointPositions, b: &JointPositions| {
        let points = |t: usize| a.left_hand(t).into_iter().zip(b.left_hand(t)).collect::<Vec<_>>();
        let each = (0..a.n_frames()).flat_map(points).map(|(a, b)| norm(sub(a.unwrap(), b.unwrap())));
        each.sum::<f64>() / (a.n_frames() * N_HAND_JOINTS) as f64
    };
    (hands(a, b) + hands(&a.mirrored(), &b.mirrored())) / 2.0
}

#[test]
fn noise_of_hands_is_halved_and_exact_hands_are_preserved() {
    let fps = FrameRate::new(30, 1);
    let truth = JointPositions::from_motion(&turning(0.0));
    let filter = Smoothing::default().fingers(fps);
    let exact = distance(&with_fitted_hands(JointPositions::from_motion(&turning(0.0)), &filter), &truth);
    assert!(exact < 0.0006, "{exact} m");
    let noisy = turning(0.005);
    let before = distance(&JointPositions::from_motion(&noisy), &truth);
    let after = distance(&with_fitted_hands(JointPositions::from_motion(&noisy), &filter), &truth);
    assert!(after < 0.5 * before, "{before} -> {after} m");
    let unchanged = with_fitted_hands(JointPositions::from_motion(&noisy), &Smoothing::None.fingers(fps));
    assert!(distance(&unchanged, &JointPositions::from_motion(&noisy)) == 0.0);
}

#[test]
fn missing_points_stay_missing_and_hands_without_knuckles_are_unchanged() {
    let mut motion = turning(0.005);
    motion.joints.slice_mut(ndarray::s![.., L_HAND + 4, ..]).fill(f32::NAN);
    motion.joints.slice_mut(ndarray::s![..40, R_HAND + 5, ..]).fill(f32::NAN);
    let raw = JointPositions::from_motion(&motion);
    let fitted = with_fitted_hands(JointPositions::from_motion(&motion), &Smoothing::default().fingers(motion.fps));
    assert!(fitted.left_hand(7)[4].is_none() && fitted.left_hand(7)[8].is_some());
    let (raw, fitted) = (raw.mirrored(), fitted.mirrored());
    assert_eq!(raw.left_hand(20), fitted.left_hand(20));
    assert_ne!(raw.left_hand(60), fitted.left_hand(60));
}

#[test]
fn noise_does_not_lengthen_short_bones() {
    let mut state = 1u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1u32 << 31) - 0.5
    };
    // The first phalanx of the left thumb, 20 mm, turns by 3 degrees per frame.
    let (from, to) = (L_HAND + 1, L_HAND + 2);
    let mut lengths = |noise: f64| {
        let mut joints = ndarray::Array3::<f32>::zeros((600, N_JOINTS, 3));
        for (t, mut frame) in joints.outer_iter_mut().enumerate() {
            let (sin, cos) = (3.0 * t as f64).to_radians().sin_cos();
            for (joint, at) in [(from, [0.1, 0.0, 0.0]), (to, [0.1 + 0.02 * cos, 0.02 * sin, 0.0])] {
                let error = [0, 1, 2].map(|_| noise * (0..12).map(|_| uniform()).sum::<f64>());
                (0..3).for_each(|k| frame[[joint, k]] = (at[k] + error[k]) as f32);
            }
        }
        bone_metres(&Motion::from_joints(FrameRate::new(30, 1), joints))[to]
    };
    let (exact, noisy) = (lengths(0.0), lengths(0.008));
    assert!((exact - 0.02).abs() < 1e-6 && (noisy - 0.02).abs() < 0.002, "{exact} {noisy}");
}
