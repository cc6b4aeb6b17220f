//! Properties of lifted joints: constant bone lengths, gaps in the hands, motion without jitter.

use crate::fixtures::keypoints::{keypoints, lifter};
use ndarray::{Array3, s};
use orator_base::motion::upper_body::{L_WRIST, R_WRIST, metres_per_unit};
use orator_base::types::interval::Interval;
use orator_base::types::pose2d::Keypoints;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton;
use orator_base::types::skeleton::{L_HAND, N_JOINTS, R_HAND};
use orator_lab::train::scene::body::{FilmedScene, Filming};
use orator_lab::train::scene::hand_shape;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Standard deviation of a bone's length divided by its mean, over those of `frames` that have it.
fn relative_spread(motion: &Motion, joint: usize, frames: std::ops::Range<usize>) -> f64 {
    let parent = skeleton::parent(joint).unwrap();
    let at = |t: usize, j: usize, k: usize| f64::from(motion.joints[[t, j, k]]);
    let length = |t: usize| (0..3).map(|k| (at(t, joint, k) - at(t, parent, k)).powi(2)).sum::<f64>().sqrt();
    let lengths: Vec<f64> = frames.map(length).filter(|l| l.is_finite()).collect();
    let n = lengths.len().max(1) as f64;
    let mean = lengths.iter().sum::<f64>() / n;
    (lengths.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / n).sqrt() / mean
}

/// Replaces the hands by ones that open and close at the wrists of the scene, with noise.
fn with_moving_hands(keypoints: &mut Keypoints, rng: &mut ChaCha8Rng) {
    let (open, closed) = (hand_shape::sample_shape(rng), hand_shape::sample_shape(rng));
    let mut noise = || 0.5 * hand_shape::normal(rng) as f32;
    for hand in [&mut keypoints.left_hand, &mut keypoints.right_hand] {
        for (t, mut frame) in hand.outer_iter_mut().enumerate() {
            let share = 0.5 + 0.5 * (0.2 * t as f64).sin();
            let [x, y] = [frame[[0, 0]], frame[[0, 1]]];
            for j in 1..21 {
                let p = [0, 1].map(|k| 400.0 * (share * open[j][k] + (1.0 - share) * closed[j][k]));
                frame[[j, 0]] = x + p[0] as f32 + noise();
                frame[[j, 1]] = y + p[1] as f32 + noise();
            }
        }
    }
}

#[test]
fn every_bone_has_a_constant_length_within_rounding() {
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    let lifter = lifter();
    let mut worst = 0.0f64;
    for _ in 0..3 {
        let mut keypoints = keypoints(&FilmedScene::from_rule(Filming::Training, 120, &mut rng), &mut rng);
        with_moving_hands(&mut keypoints, &mut rng);
        let intervals = [Interval { start: 0, end: 70 }, Interval { start: 70, end: 120 }];
        let lifted = lifter.lift_intervals(&keypoints, &intervals).unwrap();
        for (t, frame) in lifted.motion.joints.outer_iter().enumerate() {
            for (root, wrist) in [(L_HAND, skeleton::L_WRIST), (R_HAND, skeleton::R_WRIST)] {
                let is_equal = (0..3).all(|k| frame[[root, k]].to_bits() == frame[[wrist, k]].to_bits());
                assert!(is_equal, "frame {t}: the root of the hand is the wrist");
            }
        }
        for joint in (1..N_JOINTS).filter(|j| ![L_HAND, R_HAND].contains(j)) {
            // Bone lengths are estimated once per video, so both intervals share them.
            worst = worst.max(relative_spread(&lifted.motion, joint, 0..120));
        }
    }
    eprintln!("bones vary by at most {:.6} %", 100.0 * worst);
    assert!(worst < 2e-6, "{worst}");
}

#[test]
fn short_gaps_of_a_hand_are_filled_and_long_ones_stay_missing() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let lifter = lifter();
    let mut keypoints = keypoints(&FilmedScene::from_rule(Filming::Clean, 150, &mut rng), &mut rng);
    with_moving_hands(&mut keypoints, &mut rng);
    let complete = lifter.lift(&keypoints).unwrap();
    let present = |motion: &Motion, root: usize| -> Vec<bool> {
        motion.joints.slice(s![.., root + 8, 0]).iter().map(|x| x.is_finite()).collect()
    };
    let hide = |hand: &mut Array3<f32>, frames: std::ops::Range<usize>| hand.slice_mut(s![frames, .., ..]).fill(0.0);
    // Left hand: two gaps of half a second, one at the start; right hand: gaps of two (at the start) and three seconds.
    hide(&mut keypoints.left_hand, 0..7);
    hide(&mut keypoints.left_hand, 40..48);
    hide(&mut keypoints.right_hand, 0..30);
    hide(&mut keypoints.right_hand, 70..115);
    let motion = lifter.lift(&keypoints).unwrap();
    assert!(present(&motion, L_HAND).iter().all(|present| *present), "short gaps are filled");
    for (t, present) in present(&motion, R_HAND).into_iter().enumerate() {
        assert_eq!(present, !(t < 30 || (70..115).contains(&t)), "frame {t}: long gaps stay missing");
    }
    for t in 0..150 {
        assert_eq!(
            motion.mask[[t, L_HAND + 8]],
            !(t < 7 || (40..48).contains(&t)),
            "frame {t}: filled frames are masked"
        );
        assert_eq!(motion.mask[[t, R_HAND + 8]], !(t < 30 || (70..115).contains(&t)));
    }
    // The filled gap has no jump: a fingertip moves at most slightly faster than elsewhere.
    let step = |t: usize, motion: &Motion| {
        let square = |k: usize| {
            let from_wrist = |t: usize| motion.joints[[t, L_HAND + 8, k]] - motion.joints[[t, L_HAND, k]];
            (from_wrist(t + 1) - from_wrist(t)).powi(2)
        };
        (0..3).map(square).sum::<f32>().sqrt()
    };
    let largest = |motion: &Motion, frames: std::ops::Range<usize>| frames.map(|t| step(t, motion)).fold(0.0, f32::max);
    let (filled, usual) = (largest(&motion, 36..52), largest(&complete, 0..149));
    assert!(filled <= 1.2 * usual, "a fingertip moves {filled} m per frame around the gap, at most {usual} elsewhere");
}

#[test]
fn wrist_velocity_is_accurate_and_resting_wrists_do_not_jitter() {
    let mut rng = ChaCha8Rng::seed_from_u64(78);
    let lifter = lifter();
    let (mut error, mut true_speed, mut n) = (0.0, 0.0, 0);
    let mut at_rest = Vec::new();
    for _ in 0..20 {
        let scene = FilmedScene::from_rule(Filming::Training, 60, &mut rng);
        let joints = lifter.lift(&keypoints(&scene, &mut rng)).unwrap().joints;
        let scale = metres_per_unit(&scene.truth);
        for (joint, point) in [(skeleton::R_WRIST, R_WRIST), (skeleton::L_WRIST, L_WRIST)] {
            let truth = |t: usize, k: usize| 1000.0 * scale * scene.truth[t][point][k];
            let lifted = |t: usize, k: usize| 1000.0 * f64::from(joints[[t, joint, k]]);
            let norm = |v: [f64; 3]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
            for t in 0..59 {
                let true_step = [0, 1, 2].map(|k| truth(t + 1, k) - truth(t, k));
                let step_error = norm([0, 1, 2].map(|k| lifted(t + 1, k) - lifted(t, k) - true_step[k]));
                if step_error.is_finite() {
                    (error, true_speed, n) = (error + step_error, true_speed + norm(true_step), n + 1);
                }
                if t > 0 && norm(true_step) < 5.0 {
                    at_rest.push(norm([0, 1, 2].map(|k| lifted(t + 1, k) - 2.0 * lifted(t, k) + lifted(t - 1, k))));
                }
            }
        }
    }
    at_rest.retain(|v| v.is_finite());
    at_rest.sort_by(f64::total_cmp);
    let (error, true_speed) = (error / f64::from(n), true_speed / f64::from(n));
    let jitter = at_rest[at_rest.len() / 2];
    eprintln!(
        "wrists: error {error:.1} mm per frame, mean speed {true_speed:.1}; median jitter at rest {jitter:.1} mm"
    );
    assert!(error < 24.0 && jitter < 8.0, "{error} {jitter}");
}
