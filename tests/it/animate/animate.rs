//! Joints to animation: joint limits hold, left and right are symmetric, gaps and other frame rates cause no jumps, and
//! joints are unchanged where no option asks for a change.

use crate::fixtures::figures::swinging;
use ndarray::{Array3, s};
use orator_avatar::animate::rig::constraints::ClampCounter;
use orator_avatar::animate::rig::limits::{CURL_COHERENCE, ELBOW, FINGERS, Limit, SUPINATION, WRIST};
use orator_avatar::animate::solve::arm_pose::ArmPose;
use orator_avatar::animate::{AnimationOptions, Constraints, Legs, Performance, Smoothing, Yaw, perform};
use orator_base::math::rotation::Rotation;
use orator_base::motion::posture;
use orator_base::motion::posture::LiftedBody;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton;
use orator_base::types::skeleton::{L_HAND, L_SHOULDER, N_JOINTS, R_SHOULDER};
use orator_base::types::time::FrameRate;
use orator_formats::bvh::write::BvhClip;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const UNTOUCHED: AnimationOptions = AnimationOptions {
    smoothing: Smoothing::None,
    constraints: Constraints::NONE,
    yaw: Yaw::Spine,
    legs: Legs::Standing,
    breath: false,
    fps: None,
};

fn random_rotation(random: &mut ChaCha8Rng) -> Rotation {
    let [z, x, y] = [180.0, 90.0, 180.0].map(|limit: f64| random.random_range(-limit..limit));
    let about = |axis: [f64; 3], degrees: f64| Rotation::about(axis, degrees.to_radians());
    about([0.0, 0.0, 1.0], z) * about([1.0, 0.0, 0.0], x) * about([0.0, 1.0, 0.0], y)
}

fn is_within_limits(pose: &ArmPose) -> bool {
    let inside = |[low, high]: [f64; 2], angle: f64| (low - 1e-6..=high + 1e-6).contains(&angle);
    let bend = |limit: Limit, bend: orator_avatar::animate::rig::hinge::Bend| {
        inside(limit.flexion, bend.flexion) && inside(limit.side, bend.side)
    };
    let fingers = FINGERS.iter().zip(&pose.fingers).all(|(limits, bends)| (0..3).all(|k| bend(limits[k], bends[k])));
    let coherent = (0..3).all(|k| {
        let curls = [1, 2, 3, 4].map(|finger: usize| pose.fingers[finger][k].flexion);
        let mean = curls.iter().sum::<f64>() / 4.0;
        curls.iter().all(|curl| (curl - mean).abs() <= CURL_COHERENCE + 1e-6)
    });
    bend(ELBOW, pose.elbow) && inside(SUPINATION, pose.supination) && bend(WRIST, pose.wrist) && fingers && coherent
}

#[test]
fn constraints_keep_random_rotations_within_limits_and_are_idempotent() {
    let rig = perform(&swinging(0, 4), None, &UNTOUCHED).rig;
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut counter = ClampCounter::default();
    for n in 0..2_000 {
        let mut frame: Vec<Rotation> = rig.skeleton.joints.iter().map(|_| random_rotation(&mut random)).collect();
        let constraints = Constraints { limits: true, curl_coherence: true };
        constraints.apply(&rig, &mut frame, &mut counter);
        for arm in &rig.arms {
            let pose = ArmPose::from_rotations(arm, &frame);
            assert!(is_within_limits(&pose), "{n}: {pose:?}");
        }
        let mut again = frame.clone();
        constraints.apply(&rig, &mut again, &mut ClampCounter::default());
        for (joint, (a, b)) in frame.iter().zip(&again).enumerate() {
            assert!((a.inverse() * *b).angle() < 1e-6, "{n}: {} is not stable", rig.skeleton.joints[joint].name);
        }
    }
    let clamps = counter.clamps();
    assert!(clamps.iter().all(|kind| kind.joint_frames > 0 && (0.0..=1.0).contains(&kind.share)), "{clamps:?}");
    assert!(clamps.iter().all(|kind| kind.largest_excess_degrees <= 180.0 && kind.mean_excess_degrees > 0.0));
}

#[test]
fn constraints_cause_no_jumps_in_a_smooth_motion() {
    let rig = perform(&swinging(0, 4), None, &UNTOUCHED).rig;
    let mut random = ChaCha8Rng::seed_from_u64(4);
    for _ in 0..20 {
        // Fingers pass through all impossible rotations; elbows and hands stay near their limits.
        let limbs: Vec<usize> = rig.arms.iter().flat_map(|arm| [arm.forearm, arm.hand]).collect();
        let ends: [Vec<Rotation>; 2] = [0, 1].map(|_| {
            let end = |joint| {
                let share = if limbs.contains(&joint) { 0.25 } else { 1.0 };
                Rotation::IDENTITY.slerp(random_rotation(&mut random), share)
            };
            (0..rig.skeleton.joints.len()).map(end).collect()
        });
        let mut last: Option<Vec<Rotation>> = None;
        for step in 0..=4_000 {
            let share = f64::from(step) / 4_000.0;
            let between = |joint: usize| ends[0][joint].slerp(ends[1][joint], share);
            let mut frame: Vec<Rotation> = (0..rig.skeleton.joints.len()).map(between).collect();
            Constraints::default().apply(&rig, &mut frame, &mut ClampCounter::default());
            for arm in &rig.arms {
                for &joint in arm.fingers.iter().flatten().chain([&arm.forearm, &arm.hand]) {
                    let turned = last.as_ref().map_or(0.0, |last| (last[joint].inverse() * frame[joint]).angle());
                    assert!(turned.to_degrees() < 6.0, "{}: {turned}", rig.skeleton.joints[joint].name);
                }
            }
            last = Some(frame);
        }
    }
}

fn mirrored(motion: &Motion) -> Motion {
    let mut other = motion.clone();
    for joint in 0..N_JOINTS {
        let twin = motion.joints.slice(s![.., skeleton::mirror(joint), ..]);
        other.joints.slice_mut(s![.., joint, ..]).assign(&twin);
    }
    other.joints.slice_mut(s![.., .., 0]).mapv_inplace(|x| -x);
    Motion::from_joints(motion.fps, other.joints)
}

/// Largest difference of quaternion components between a clip and the mirror image of the other.
fn asymmetry(clip: &BvhClip, other: &BvhClip) -> f64 {
    let mut worst = 0.0f64;
    for (joint, bone) in clip.skeleton.joints.iter().enumerate() {
        let swapped = match (bone.name.strip_prefix("Left"), bone.name.strip_prefix("Right")) {
            (Some(rest), _) => format!("Right{rest}"),
            (_, Some(rest)) => format!("Left{rest}"),
            _ => bone.name.clone(),
        };
        if bone.end {
            continue;
        }
        let twin = other.skeleton.find(&swapped).unwrap();
        for (a, b) in clip.local.iter().zip(&other.local) {
            let (a, b) = (a[joint], b[twin].mirrored());
            let sign = if a.w * b.w + (0..3).map(|k| a.v[k] * b.v[k]).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
            worst = worst.max((a.w - sign * b.w).abs());
            (0..3).for_each(|k| worst = worst.max((a.v[k] - sign * b.v[k]).abs()));
        }
    }
    worst
}

/// Noisy motion with random gaps of 1 to 19 frames.
fn with_gaps(seed: u64, n_frames: usize) -> Motion {
    let mut motion = swinging(seed, n_frames);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for _ in 0..60 {
        let (joint, start) = (random.random_range(1..N_JOINTS), random.random_range(0..n_frames));
        let end = (start + random.random_range(1..20)).min(n_frames);
        motion.joints.slice_mut(s![start..end, joint, ..]).fill(f32::NAN);
    }
    let noise = |v: f32| v + random.random_range(-0.02..0.02);
    motion.joints.mapv_inplace(noise);
    motion.joints.slice_mut(s![.., 0, ..]).fill(0.0);
    Motion::from_joints(motion.fps, motion.joints)
}

#[test]
fn a_mirrored_motion_gives_a_mirrored_animation() {
    let fixed = AnimationOptions { smoothing: Smoothing::SavitzkyGolay, ..AnimationOptions::default() };
    let faster =
        AnimationOptions { fps: Some(FrameRate::new(60, 1)), yaw: Yaw::Removed, ..AnimationOptions::default() };
    for seed in 0..6 {
        let motion = with_gaps(seed, 80);
        for options in [AnimationOptions::default(), UNTOUCHED, fixed, faster] {
            let clips = [&motion, &mirrored(&motion)].map(|motion| perform(motion, None, &options).clip);
            let difference = asymmetry(&clips[0], &clips[1]);
            assert!(difference < 1e-9, "seed {seed}, {options:?}: {difference}");
        }
    }
}

fn max_distance_mm(a: &Motion, b: &Motion) -> f64 {
    let squares = (&a.joints - &b.joints).mapv(|v| f64::from(v).powi(2)).sum_axis(ndarray::Axis(2));
    1000.0 * squares.into_iter().fold(0.0, f64::max).sqrt()
}

#[test]
fn joints_with_rigid_palms_are_preserved_and_animation_is_idempotent() {
    for seed in 0..3 {
        let rigid = perform(&swinging(seed, 40), None, &UNTOUCHED).motion();
        let difference = max_distance_mm(&perform(&rigid, None, &UNTOUCHED).motion(), &rigid);
        assert!(difference < 0.1, "seed {seed}: {difference} mm");
        let limited = AnimationOptions { smoothing: Smoothing::None, ..AnimationOptions::default() };
        let once = perform(&rigid, None, &limited);
        assert!(once.report.clamps.iter().any(|kind| kind.joint_frames > 0));
        let twice = perform(&once.motion(), None, &limited);
        let difference = max_distance_mm(&twice.motion(), &once.motion());
        assert!(difference < 0.1, "seed {seed}: {difference} mm");
    }
}

#[test]
fn smoothing_reduces_jerk_and_preserves_bone_lengths() {
    let motion = with_gaps(1, 150);
    let Performance { report, clip, rig } = perform(&motion, None, &AnimationOptions::default());
    let ratio = |jerk: orator_avatar::animate::performance::Jerk| jerk.after.unwrap() / jerk.before.unwrap();
    assert!(ratio(report.arms) < 0.4 && ratio(report.hands) < 0.5, "{report:?}");
    for frame in 0..clip.n_frames() {
        let positions = clip.positions(frame);
        for (joint, bone) in rig.skeleton.joints.iter().enumerate() {
            let Some(parent) = bone.parent else { continue };
            let square = |k: usize| (positions[joint][k] - positions[parent][k]).powi(2);
            let length = (0..3).map(|k| bone.offset[k].powi(2)).sum::<f64>().sqrt();
            assert!(((0..3).map(square).sum::<f64>().sqrt() - length).abs() < 1e-9);
        }
    }
    let unsmoothed =
        perform(&motion, None, &AnimationOptions { smoothing: Smoothing::None, ..AnimationOptions::default() }).report;
    assert!(unsmoothed.arms.after.unwrap() > 2.0 * report.arms.after.unwrap());
}

#[test]
fn resampling_passes_through_the_frames_without_velocity_jumps() {
    let motion = swinging(2, 40);
    let limited = AnimationOptions { smoothing: Smoothing::None, ..AnimationOptions::default() };
    let at = |rate: u32| perform(&motion, None, &AnimationOptions { fps: Some(FrameRate::new(rate, 1)), ..limited });
    let (given, fast) = (perform(&motion, None, &limited), at(60));
    assert_eq!((fast.clip.n_frames(), fast.clip.fps), (160, FrameRate::new(60, 1)));
    for frame in 0..40 {
        for (a, b) in given.clip.local[frame].iter().zip(&fast.clip.local[4 * frame]) {
            assert!((a.inverse() * *b).angle() < 1e-6);
        }
    }
    // Speed before and after a frame differs no more than it does between frames.
    let upper = fast.rig.arms[0].upper;
    let clip = perform(&motion, None, &UNTOUCHED).clip.resampled(FrameRate::new(1500, 1));
    let turn = |t: usize| (clip.local[t - 1][upper].inverse() * clip.local[t][upper]).angle();
    let change = |t: usize| (turn(t + 1) - turn(t)).abs();
    let corner = (1..38).map(|frame| change(100 * frame)).fold(0.0, f64::max);
    let between = (1..38).map(|frame| change(100 * frame + 50)).fold(0.0, f64::max);
    assert!(corner < 2.0 * between + 1e-6, "{corner} {between}");
}

#[test]
fn removing_yaw_faces_forward_and_preserves_joint_distances() {
    let mut motion = swinging(4, 60);
    // The body turns about the vertical.
    for (t, mut frame) in motion.joints.outer_iter_mut().enumerate() {
        let (sin, cos) = (0.8 * (t as f32 * 0.1).sin()).sin_cos();
        for mut point in frame.outer_iter_mut() {
            let (x, z) = (point[0], point[2]);
            (point[0], point[2]) = (cos * x + sin * z, cos * z - sin * x);
        }
    }
    let yaw = |motion: &Motion| {
        let line = |t: usize, k: usize| motion.joints[[t, L_SHOULDER, k]] - motion.joints[[t, R_SHOULDER, k]];
        (0..60).map(|t| line(t, 2).atan2(line(t, 0)).abs().to_degrees()).fold(0.0, f32::max)
    };
    let [with_yaw, without_yaw] =
        [Yaw::Spine, Yaw::Removed].map(|yaw| perform(&motion, None, &AnimationOptions { yaw, ..UNTOUCHED }).motion());
    assert!(yaw(&with_yaw) > 30.0 && yaw(&without_yaw) < 1e-2, "{} {}", yaw(&with_yaw), yaw(&without_yaw));
    for t in 0..60 {
        let length = |motion: &Motion| (0..3).map(|k| motion.joints[[t, L_HAND, k]].powi(2)).sum::<f32>().sqrt();
        assert!((length(&with_yaw) - length(&without_yaw)).abs() < 1e-4);
    }
}

#[test]
fn the_head_follows_the_face_and_is_neutral_without_one() {
    let motion = swinging(3, 90);
    // A face turned to the person's left for 45 frames, 500 px per metre; then no face.
    let points = [[0.0, 0.02, 0.1], [0.03, -0.03, 0.08], [-0.03, -0.03, 0.08], [0.075, 0.0, 0.0], [-0.075, 0.0, 0.0]];
    let mut body = Array3::zeros((90, 17, 3));
    for t in 0..45 {
        let yaw = 0.6f32;
        for (k, [x, y, z]) in points.into_iter().enumerate() {
            let point = [640.0 + 500.0 * (yaw.cos() * x + yaw.sin() * z), 300.0 + 500.0 * y, 0.95];
            body.slice_mut(s![t, k, ..]).assign(&ndarray::arr1(&point));
        }
    }
    let performance =
        perform(&motion, Some(&posture::estimate(body.view(), LiftedBody::default())), &AnimationOptions::default());
    assert_eq!(performance.report.face_frames, Some(45));
    let (rig, clip) = (&performance.rig, &performance.clip);
    let forward = |t: usize| rig.skeleton.world(&clip.local[t])[rig.head].turn([0.0, 0.0, 1.0]);
    for t in [5, 20, 40] {
        let [x, y, _] = forward(t);
        assert!((x - 0.6f64.sin()).abs() < 0.12 && y.abs() < 0.15, "frame {t}: {:?}", forward(t));
    }
    for joint in [rig.neck, rig.head] {
        assert!(clip.local[70][joint].angle() < 1e-6 && clip.local[20][joint].angle() > 0.1);
    }
}
