//! Motion to BVH: the file, read by an independent parser and evaluated with plain matrices, reproduces the motion;
//! left stays left; gaps cause no jumps.

use crate::fixtures::animation::bvh::{Bvh, worst_mm};
use crate::fixtures::figures::{FPS, swinging};
use ndarray::{Array3, s};
use orator_avatar::animate::rig::rig::Rig;
use orator_avatar::animate::{AnimationOptions, Constraints, Performance, Smoothing, perform};
use orator_base::math::rotation::Rotation;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton;
use orator_base::types::skeleton::{L_HAND, N_JOINTS, R_HAND};
use orator_formats::authors_txt;
use orator_formats::bvh::write::BvhClip;
use orator_test_support::skip::real_data;

fn performed(motion: &Motion) -> Performance {
    perform(motion, None, &AnimationOptions::default())
}

fn text(motion: &Motion) -> String {
    performed(motion).clip.to_bvh()
}

fn clip(motion: &Motion) -> BvhClip {
    performed(motion).clip
}

#[test]
fn the_bvh_reproduces_the_joints_within_a_tenth_of_a_millimetre() {
    for seed in 0..4 {
        let performance = performed(&swinging(seed, 60));
        let bvh = Bvh::parse(&performance.clip.to_bvh());
        assert!((bvh.frame_secs - 1.0 / FPS.per_sec()).abs() < 1e-7);
        let worst = worst_mm(&performance.motion(), &bvh, |frame| bvh.places(frame));
        assert!(worst < 0.1, "seed {seed}: {worst} mm");
    }
}

#[test]
fn a_t_pose_is_the_rest_pose_facing_plus_z() {
    let rig = Rig::from_motion(&swinging(0, 8));
    let local = vec![Rotation::IDENTITY; rig.skeleton.joints.len()];
    let positions = rig.skeleton.positions(rig.root, &local);
    let neck = positions[rig.positions[skeleton::NECK]];
    let joints = Array3::from_shape_fn((2, N_JOINTS, 3), |(_, joint, k)| {
        let sign = if k == 0 { 1.0 } else { -1.0 };
        (sign * (positions[rig.positions[joint]][k] - neck[k]) / 100.0) as f32
    });
    assert!(joints[[0, skeleton::L_WRIST, 0]] > 0.5, "the left wrist is at the right of the image");
    let clip = clip(&Motion::from_joints(FPS, joints));
    // The hand axis runs to the centre of the knuckles, a degree from the rest axis; other joints are at rest.
    for (joint, rotation) in clip.skeleton.joints.iter().zip(&clip.local[0]) {
        let degrees = rotation.angle().to_degrees();
        assert!(degrees < 3.0, "{} is turned by {degrees} degrees", joint.name);
    }
    let soles = positions.iter().map(|position| position[1]).fold(f64::MAX, f64::min);
    assert!(soles.abs() < 1e-9, "the figure stands on the floor");
}

#[test]
fn gaps_are_interpolated_and_an_undetected_hand_is_relaxed() {
    let complete = swinging(2, 60);
    let mut motion = complete.clone();
    motion.joints.slice_mut(s![.., L_HAND..R_HAND, ..]).fill(f32::NAN);
    motion.joints.slice_mut(s![20..24, .., ..]).fill(f32::NAN);
    motion.joints.slice_mut(s![..3, 1.., ..]).fill(f32::NAN);
    let clip = clip(&motion);
    let at = |name: &str| clip.skeleton.find(name).unwrap();
    let finger = at("LeftHandMiddle2");
    for frame in 0..60 {
        assert!(clip.local[frame].iter().all(|r| r.angle().is_finite()));
        assert!((clip.local[frame][finger].angle().to_degrees() - 26.0).abs() < 1e-9);
    }
    assert_eq!(clip.local[0][at("RightArm")], clip.local[3][at("RightArm")]);
    let step = |frame: usize| {
        let arm = at("RightForeArm");
        (clip.local[frame][arm].inverse() * clip.local[frame + 1][arm]).angle().to_degrees()
    };
    assert!((19..24).map(step).fold(0.0, f64::max) < 30.0);

    for n_frames in [0, 1] {
        let empty = Motion::from_joints(FPS, Array3::from_elem((n_frames, N_JOINTS, 3), f32::NAN));
        assert_eq!(Bvh::parse(&text(&empty)).frames.len(), n_frames);
    }
}

#[test]
fn a_straightening_arm_does_not_twist() {
    // The left arm is held to the side; the elbow straightens, overextends by a degree and bends again.
    let bend = |t: usize| 2.0 * (t as f64 - 30.0).abs() - 1.0;
    let mut motion = swinging(3, 60);
    for frame in 0..60 {
        let angle = bend(frame).to_radians();
        let shoulder = [0.17, 0.05, 0.0];
        let elbow = [shoulder[0] + 0.28, 0.15, 0.0];
        let wrist = [elbow[0] + 0.25 * angle.cos(), 0.15, -0.25 * angle.sin()];
        for (joint, position) in [(4, shoulder), (5, elbow), (6, wrist)] {
            (0..3).for_each(|k| motion.joints[[frame, joint, k]] = position[k] as f32);
        }
    }
    let clip = clip(&motion);
    let upper = clip.skeleton.find("LeftArm").unwrap();
    for frame in 0..59 {
        let step = (clip.local[frame].get(upper).unwrap().inverse() * clip.local[frame + 1][upper]).angle();
        assert!(step.to_degrees() < 15.0, "frame {frame}: {} degrees", step.to_degrees());
    }
}

#[test]
fn released_clips_preserve_their_gestures() {
    let Some(folder) = real_data("data/released_clips") else { return };
    let motion = authors_txt::read(&folder.join("gt_interval_102571.txt"), FPS).unwrap();
    let untouched =
        AnimationOptions { smoothing: Smoothing::None, constraints: Constraints::NONE, ..AnimationOptions::default() };
    let clip = perform(&motion, None, &untouched).clip;
    // Bone lengths of the clip vary by a few percent: the file has their directions and a constant length for each.
    let rig = Rig::from_motion(&motion);
    let mut distances = Vec::new();
    for frame in 0..motion.n_frames() {
        let positions = clip.positions(frame);
        let neck = positions[rig.positions[0]];
        for joint in 1..N_JOINTS {
            let position = positions[rig.positions[joint]];
            let difference = |k: usize, sign: f64| {
                (position[k] - neck[k]) / 100.0 - sign * f64::from(motion.joints[[frame, joint, k]])
            };
            distances.push(difference(0, 1.0).hypot(difference(1, -1.0)).hypot(difference(2, -1.0)));
        }
    }
    let mean = distances.iter().sum::<f64>() / distances.len() as f64;
    assert!(mean < 0.03, "{mean} m");
    let jumps = (1..motion.n_frames())
        .flat_map(|t| rig.arms.iter().flat_map(move |arm| [arm.upper, arm.forearm].map(|joint| (t, joint))))
        .filter(|&(t, joint)| (clip.local[t - 1][joint].inverse() * clip.local[t][joint]).angle() > 1.2)
        .count();
    assert!(jumps < 8, "{jumps} sudden turns of an arm in {} frames", motion.n_frames());
}
