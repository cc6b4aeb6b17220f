//! Roll and pitch of the camera: found on upright speakers filmed at known angles, and taken out on request.

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

/// A gesturing speaker who sits or stands upright, the torso vertical, turned `yaw` to the side.
fn upright(n_frames: usize, yaw: f64, rng: &mut ChaCha8Rng) -> Vec<Pose> {
    let turn = Rotation::about([0.0, 1.0, 0.0], yaw);
    let mut poses = body_motion::gesture(rng, n_frames, 1.0 / 15.0);
    for pose in &mut poses {
        (pose[R_HIP], pose[L_HIP]) = ([-0.11, 0.5, 0.0], [0.11, 0.5, 0.0]);
        *pose = pose.map(|p| turn.turn(p));
    }
    poses
}

/// Keypoints of a camera 2 m away that looks `pitch` down on the neck and is rolled by `roll`, radians.
fn film(poses: &[Pose], roll: f64, pitch: f64) -> Keypoints {
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
    Keypoints { fps: FrameRate::new(15, 1), image_size: [1280, 720], body, left_hand: hand.clone(), right_hand: hand }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Degrees between the torso (hips to neck) and the vertical, the median over the frames.
fn lean(extra: &Array3<f32>) -> f64 {
    let of_frame = |frame: ndarray::ArrayView2<f32>| {
        let [x, y, z] = [0, 1, 2].map(|k| f64::from(frame[[1, k]] + frame[[2, k]]));
        x.hypot(z).atan2(y).to_degrees()
    };
    median(extra.outer_iter().map(of_frame).collect())
}

#[test]
fn known_angles_are_found_and_taken_out() {
    let mut rng = ChaCha8Rng::seed_from_u64(41);
    let lifters = [false, true].map(|level| Lifter::new(&config::LiftConfig { level, ..Default::default() }).unwrap());
    let (mut roll_off, mut pitch_off, mut leans, mut levelled) = (vec![], vec![], vec![], vec![]);
    for _ in 0..24 {
        let poses = upright(60, rng.random_range(-0.8..0.8), &mut rng);
        let (roll, pitch) = (rng.random_range(-0.25f64..0.25), rng.random_range(-0.25f64..0.4));
        let keypoints = film(&poses, roll, pitch);
        let [as_seen, level] = lifters.each_ref().map(|lifter| lifter.lift_all(&keypoints).unwrap());
        let camera = as_seen.cameras[0];
        assert_eq!(camera.interval, Interval { start: 0, end: 60 });
        assert_eq!(level.cameras[0], camera, "what is told is how it was");
        roll_off.push((camera.roll_degrees.unwrap() - roll.to_degrees()).abs());
        pitch_off.push((camera.pitch_degrees.unwrap() - pitch.to_degrees()).abs());
        leans.push(lean(&as_seen.extra));
        levelled.push(lean(&level.extra));
        // turned as a whole: the same arms
        let wrist = |joints: &Array3<f32>| joints.slice(s![30, 3, ..]).mapv(|v| v * v).sum().sqrt();
        assert!((wrist(&as_seen.motion.joints) - wrist(&level.motion.joints)).abs() < 1e-4);
    }
    let [roll, pitch, lean, level] = [roll_off, pitch_off, leans, levelled].map(median);
    eprintln!(
        "roll {roll:.1}, pitch {pitch:.1} degrees off; torsos lean {lean:.1} as seen, {level:.1} levelled (medians)"
    );
    assert!(roll < 3.0 && pitch < 8.0, "{roll} {pitch}");
    assert!(level < 2.0 && lean > 8.0, "{level} {lean}");
}

#[test]
fn without_hips_the_pitch_is_not_known() {
    let mut rng = ChaCha8Rng::seed_from_u64(42);
    let lifter = Lifter::new(&config::LiftConfig { level: true, ..Default::default() }).unwrap();
    let (mut off, n) = (vec![], 12);
    for _ in 0..n {
        let roll: f64 = rng.random_range(-0.25..0.25);
        let mut keypoints = film(&upright(60, 0.0, &mut rng), roll, 0.1);
        keypoints.body.slice_mut(s![.., 11..13, ..]).fill(0.0);
        let lifted = lifter.lift_all(&keypoints).unwrap();
        assert!(lifted.extra.slice(s![.., 1.., ..]).iter().all(|v| v.is_nan()), "hips are not made up");
        assert_eq!(lifted.cameras[0].pitch_degrees, None);
        off.extend(lifted.cameras[0].roll_degrees.map(|found| (found - roll.to_degrees()).abs()));
    }
    assert!(off.len() >= n / 2, "most face the camera");
    let off = median(off);
    eprintln!("roll by the shoulders {off:.1} degrees off (median)");
    assert!(off < 8.0, "{off}");
    // turned to the side neither is known, and what is not known is left as it is
    let mut keypoints = film(&upright(60, 1.0, &mut rng), 0.0, 0.1);
    keypoints.body.slice_mut(s![.., 11..13, ..]).fill(0.0);
    let lifted = lifter.lift_all(&keypoints).unwrap();
    assert_eq!((lifted.cameras[0].roll_degrees, lifted.cameras[0].pitch_degrees), (None, None));
    assert!(lifted.n_frames == 60);
}
