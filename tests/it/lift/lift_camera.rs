//! Camera roll and pitch are estimated from upright speakers filmed at known angles, and compensated on request.

use crate::fixtures::keypoints::POINTS;
use ndarray::{Array3, s};
use orator_base::math::rotation::Rotation;
use orator_base::motion::upper_body::{L_HIP, Pose, R_HIP};
use orator_base::types::interval::Interval;
use orator_base::types::pose2d::Keypoints;
use orator_base::types::time::FrameRate;
use orator_dataset::config;
use orator_lab::train::scene::body_motion;
use orator_pipeline::lift::Lifter;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Poses of a gesturing speaker with a vertical torso, turned to the side by `yaw`, radians.
fn upright(n_frames: usize, yaw: f64, rng: &mut ChaCha8Rng) -> Vec<Pose> {
    let turn = Rotation::about([0.0, 1.0, 0.0], yaw);
    let mut poses = body_motion::gesture(rng, n_frames, 1.0 / 15.0);
    for pose in &mut poses {
        (pose[R_HIP], pose[L_HIP]) = ([-0.11, 0.5, 0.0], [0.11, 0.5, 0.0]);
        *pose = pose.map(|p| turn.turn(p));
    }
    poses
}

/// Keypoints seen by a camera 2 m from the neck, pitched down by `pitch` and rolled by `roll`, radians.
fn project_keypoints(poses: &[Pose], roll: f64, pitch: f64) -> Keypoints {
    let view = Rotation::about([0.0, 0.0, 1.0], roll) * Rotation::about([1.0, 0.0, 0.0], pitch);
    let mut body = Array3::zeros((poses.len(), 17, 3));
    for (t, pose) in poses.iter().enumerate() {
        for (point, coco, _) in POINTS {
            let [x, y, z] = view.turn(pose[point]);
            let px = 1500.0 / (z + 2.0);
            body.slice_mut(s![t, coco, ..]).assign(&ndarray::arr1(&[
                (640.0 + x * px) as f32,
                (300.0 + y * px) as f32,
                0.9,
            ]));
        }
    }
    let hand = Array3::zeros((poses.len(), 21, 3));
    Keypoints {
        fps: FrameRate::new(15, 1),
        image_size: [1280, 720],
        body,
        left_hand: hand.clone(),
        right_hand: hand,
        hand_depth: None,
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Median angle between the torso (hips to neck) and the vertical, degrees.
fn lean(extra: &Array3<f32>) -> f64 {
    let of_frame = |frame: ndarray::ArrayView2<f32>| {
        let [x, y, z] = [0, 1, 2].map(|k| f64::from(frame[[1, k]] + frame[[2, k]]));
        x.hypot(z).atan2(y).to_degrees()
    };
    median(extra.outer_iter().map(of_frame).collect())
}

#[test]
fn known_camera_angles_are_estimated_and_compensated() {
    let mut rng = ChaCha8Rng::seed_from_u64(41);
    let lifters = [false, true].map(|level| Lifter::new(&config::LiftConfig { level, ..Default::default() }).unwrap());
    let (mut roll_errors, mut pitch_errors, mut leans, mut levelled) = (vec![], vec![], vec![], vec![]);
    for _ in 0..24 {
        let poses = upright(60, rng.random_range(-0.8..0.8), &mut rng);
        let (roll, pitch) = (rng.random_range(-0.25f64..0.25), rng.random_range(-0.25f64..0.4));
        let keypoints = project_keypoints(&poses, roll, pitch);
        let [uncorrected, level] = lifters.each_ref().map(|lifter| lifter.lift_all(&keypoints).unwrap());
        let camera = uncorrected.cameras[0];
        assert_eq!(camera.interval, Interval { start: 0, end: 60 });
        assert_eq!(level.cameras[0], camera, "the reported angles are those before compensation");
        roll_errors.push((camera.roll_degrees.unwrap() - roll.to_degrees()).abs());
        pitch_errors.push((camera.pitch_degrees.unwrap() - pitch.to_degrees()).abs());
        leans.push(lean(&uncorrected.extra));
        levelled.push(lean(&level.extra));
        // Compensation is a rigid rotation: distances are unchanged.
        let wrist = |joints: &Array3<f32>| joints.slice(s![30, 3, ..]).mapv(|v| v * v).sum().sqrt();
        assert!((wrist(&uncorrected.motion.joints) - wrist(&level.motion.joints)).abs() < 1e-4);
    }
    let [roll, pitch, lean, level] = [roll_errors, pitch_errors, leans, levelled].map(median);
    eprintln!(
        "median errors: roll {roll:.1}, pitch {pitch:.1} degrees; median leans: raw {lean:.1}, levelled {level:.1}"
    );
    assert!(roll < 3.0 && pitch < 8.0, "{roll} {pitch}");
    assert!(level < 2.0 && lean > 8.0, "{level} {lean}");
}

#[test]
fn without_hips_the_pitch_is_unknown() {
    let mut rng = ChaCha8Rng::seed_from_u64(42);
    let lifter = Lifter::new(&config::LiftConfig { level: true, ..Default::default() }).unwrap();
    let (mut errors, n) = (vec![], 12);
    for _ in 0..n {
        let roll: f64 = rng.random_range(-0.25..0.25);
        let mut keypoints = project_keypoints(&upright(60, 0.0, &mut rng), roll, 0.1);
        keypoints.body.slice_mut(s![.., 11..13, ..]).fill(0.0);
        let lifted = lifter.lift_all(&keypoints).unwrap();
        assert!(lifted.extra.slice(s![.., 1.., ..]).iter().all(|v| v.is_nan()), "hips are missing");
        assert_eq!(lifted.cameras[0].pitch_degrees, None);
        errors.extend(lifted.cameras[0].roll_degrees.map(|found| (found - roll.to_degrees()).abs()));
    }
    assert!(errors.len() >= n / 2, "roll is estimated for most speakers");
    let error = median(errors);
    eprintln!("roll from the shoulders: median error {error:.1} degrees");
    assert!(error < 8.0, "{error}");
    // For a speaker turned to the side neither angle is known, and the joints are not rotated.
    let mut keypoints = project_keypoints(&upright(60, 1.0, &mut rng), 0.0, 0.1);
    keypoints.body.slice_mut(s![.., 11..13, ..]).fill(0.0);
    let lifted = lifter.lift_all(&keypoints).unwrap();
    assert_eq!((lifted.cameras[0].roll_degrees, lifted.cameras[0].pitch_degrees), (None, None));
    assert!(lifted.n_frames == 60);
}
