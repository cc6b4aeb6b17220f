//! The default animation of captured motion: arms and fingers stay close to the capture, and added noise is reduced.

use crate::fixtures::figures::swinging;
use ndarray::{Array2, Array3, s};
use orator_avatar::animate::rig::rig::Rig;
use orator_avatar::animate::{AnimationOptions, Constraints, Performance, Smoothing, perform};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{norm, scale};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_HAND, L_WRIST, N_JOINTS, NECK, R_HAND, R_WRIST};
use orator_base::types::time::FrameRate;
use orator_formats::bvh::write::BvhClip;
use orator_formats::npz::Npz;
use orator_lab::demo::people::folder::SetPart;
use orator_lab::mocap::captured::source::MotionSource;
use orator_test_support::skip::real_data;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

/// SMPL-X joints of each arm: clavicle, upper arm, forearm, hand, and the first of the fifteen finger joints.
const ARMS: [[usize; 5]; 2] = [[13, 16, 18, 20, 25], [14, 17, 19, 21, 40]];
/// Offsets of the thumb, index, middle, ring and little finger among the fifteen finger joints.
const FINGERS: [usize; 5] = [12, 0, 3, 9, 6];

/// Finger tips of both hands.
fn tips() -> Vec<usize> {
    [L_HAND, R_HAND].iter().flat_map(|root| (1..=5).map(move |finger| root + 4 * finger)).collect()
}

/// The captured rotations of the first half of the talk on a rig of ours: both have the same T-pose as rest pose, with
/// world axes.
fn on_our_rig(path: &Path, rig: &Rig, fps: FrameRate) -> Motion {
    let poses = Npz::open(path).unwrap().numbers("poses", &[None, Some(165)]).unwrap();
    let turned = |t: usize, joint: usize| {
        let v: [f64; 3] = std::array::from_fn(|k| poses[[t, 3 * joint + k]]);
        let angle = norm(v);
        if angle < 1e-12 { Rotation::IDENTITY } else { Rotation::about(scale(v, 1.0 / angle), angle) }
    };
    let frame = |t: usize| {
        let mut local = vec![Rotation::IDENTITY; rig.skeleton.joints.len()];
        local[rig.spine] = turned(t, 0) * turned(t, 3);
        local[rig.chest] = turned(t, 6) * turned(t, 9);
        for (arm, [clavicle, upper, fore, hand, fingers]) in rig.arms.iter().zip(ARMS) {
            for (joint, captured) in
                [(arm.clavicle, clavicle), (arm.upper, upper), (arm.forearm, fore), (arm.hand, hand)]
            {
                local[joint] = turned(t, captured);
            }
            for (joints, first) in arm.fingers.iter().zip(FINGERS) {
                joints.iter().enumerate().for_each(|(k, &joint)| local[joint] = turned(t, fingers + first + k));
            }
        }
        local
    };
    let local = (0..poses.shape()[0] * 47 / 100).map(frame).collect();
    let clip = BvhClip { root: rig.root, travel: Vec::new(), skeleton: rig.skeleton.clone(), fps, local };
    Performance { rig: rig.clone(), clip, report: Default::default() }.motion()
}

/// Distances of `joints` from the ground truth, mm, ascending.
fn errors(motion: &Motion, truth: &Motion, joints: &[usize]) -> Vec<f64> {
    let mut errors: Vec<f64> = (0..truth.n_frames())
        .flat_map(|t| joints.iter().map(move |&joint| (t, joint)))
        .map(|(t, joint)| {
            let square = |k: usize| f64::from(motion.joints[[t, joint, k]] - truth.joints[[t, joint, k]]).powi(2);
            1000.0 * (0..3).map(square).sum::<f64>().sqrt()
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    errors
}

fn mean(errors: &[f64]) -> f64 {
    errors.iter().sum::<f64>() / errors.len() as f64
}

/// The motion with normally distributed noise in every joint except the neck.
fn with_noise(truth: &Motion, metres: f32) -> Motion {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut gauss = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f32>();
    let mut noisy = truth.clone();
    noisy.joints += &Array3::from_shape_simple_fn(truth.joints.raw_dim(), || metres * gauss());
    noisy.joints.slice_mut(s![.., NECK, ..]).fill(0.0);
    for (root, wrist) in [(L_HAND, L_WRIST), (R_HAND, R_WRIST)] {
        let at = noisy.joints.slice(s![.., wrist, ..]).to_owned();
        noisy.joints.slice_mut(s![.., root, ..]).assign(&at);
    }
    noisy
}

/// Speeds of the wrists, m/s, ascending.
fn wrist_speeds(motion: &Motion) -> Vec<f64> {
    let later = Motion { joints: motion.joints.slice(s![1.., .., ..]).to_owned(), ..motion.clone() };
    let later = Motion { mask: Array2::from_elem((later.joints.shape()[0], 49), true), ..later };
    let steps = errors(motion, &later, &[L_WRIST, R_WRIST]);
    steps.into_iter().map(|mm| mm / 1000.0 * motion.fps.per_sec()).collect()
}

/// Asserts that the default animation keeps the finger tips within 2 mm, 95 % within 6 mm, and clamps no angles.
fn assert_captured_tips(truth: &Motion, name: &str) {
    let performance = perform(truth, None, &AnimationOptions::default());
    let tip_errors = errors(&performance.motion(), truth, &tips());
    let (mean_error, percentile_95) = (mean(&tip_errors), tip_errors[tip_errors.len() * 95 / 100]);
    eprintln!("{name}: finger tips {mean_error:.1} mm, 95 % {percentile_95:.1} mm");
    assert!(mean_error < 2.0 && percentile_95 < 6.0, "{name}: {mean_error} {percentile_95}");
    for clamps in &performance.report.clamps {
        assert!(clamps.share <= 0.001, "{name}: {clamps:?}");
    }
}

#[test]
fn captured_joints_stay_at_their_positions_and_noise_is_reduced() {
    let Some(data) = real_data("data") else { return };
    let takes = |source: MotionSource| source.takes(&data, SetPart::Middle).unwrap();
    for take in takes(MotionSource::Beat) {
        // Joint positions: the distance from neck to shoulder varies.
        let truth = take.motion();
        assert_captured_tips(&truth, &take.name);
        for mm in [3.0, 5.0, 10.0] {
            let noisy = with_noise(&truth, mm / 1000.0);
            let animated = perform(&noisy, None, &AnimationOptions::default()).motion();
            let [before, after] = [&noisy, &animated].map(|motion| mean(&errors(motion, &truth, &tips())));
            eprintln!("{mm} mm of noise: finger tips {before:.1} -> {after:.1} mm");
            assert!(after < 0.9 * before, "{mm} mm of noise: {before} -> {after} mm");
        }
    }
    // Estimated fingers of several speakers: their wrists turn implausibly, their fingers do not.
    let (mut n_clamps, mut n_frames) = (0, 0);
    for take in takes(MotionSource::Ted) {
        let report = perform(&take.motion(), None, &AnimationOptions::default()).report;
        let arm = ["elbow", "forearm", "wrist"];
        let fingers = report.clamps.iter().filter(|clamps| !arm.iter().any(|part| clamps.kind.starts_with(part)));
        n_clamps += fingers.map(|clamps| clamps.joint_frames).sum::<usize>();
        n_frames += report.n_frames;
    }
    let share = n_clamps as f64 / (60 * n_frames) as f64;
    assert!(share <= 0.001, "{share} of the angles of fingers are clamped");
}

#[test]
fn captured_arms_and_fingers_are_preserved_and_noise_is_reduced() {
    let Some(path) = real_data("data/speech_motion/beat2_2_scott_0_1_1_smplx30fps.npz") else { return };
    let fps = FrameRate::new(30, 1);
    let undetected = Motion::from_joints(fps, Array3::from_elem((1, N_JOINTS, 3), f32::NAN));
    for source in [&swinging(0, 4), &undetected] {
        assert_captured_tips(&on_our_rig(&path, &Rig::from_motion(source), fps), "rotations on our rig");
    }
    let truth = on_our_rig(&path, &Rig::from_motion(&swinging(0, 4)), fps);
    let animated = perform(&truth, None, &AnimationOptions::default()).motion();
    let [before, after] = [&truth, &animated].map(|motion| {
        let speeds = wrist_speeds(motion);
        speeds[speeds.len() * 99 / 100]
    });
    assert!((after / before - 1.0).abs() < 0.03, "{before} -> {after} m/s");

    let noisy = with_noise(&truth, 0.005);
    let wrists = [L_WRIST, R_WRIST];
    let error = |smoothing: Smoothing| {
        let options = AnimationOptions { smoothing, constraints: Constraints::NONE, ..AnimationOptions::default() };
        mean(&errors(&perform(&noisy, None, &options).motion(), &truth, &wrists))
    };
    let [raw, fixed, adaptive] = [Smoothing::None, Smoothing::SavitzkyGolay, Smoothing::default()].map(error);
    eprintln!("wrists with 5 mm of noise: {raw:.1} mm, {fixed:.1} fixed windows, {adaptive:.1} adaptive");
    assert!(adaptive < 0.9 * fixed && adaptive < 0.75 * raw, "{raw} {fixed} {adaptive}");
}
