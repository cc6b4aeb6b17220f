//! Made-up motion with bones of constant length, for tests.

use ndarray::Array3;
use orator::types::pose3d::Motion;
use orator::types::skeleton::{self, L_HAND, L_WRIST, N_JOINTS, R_HAND, R_WRIST};
use orator::types::time::FrameRate;

pub const FPS: FrameRate = FrameRate::new(15, 1);

/// Arms and fingers that swing widely, every bone of constant length: arms up to backwards and overhead, fingers
/// within a cone about the hand's own direction.
pub fn swinging(seed: u64, n_frames: usize) -> Motion {
    let wave = |joint: usize, axis: usize, frame: usize| {
        let phase = (seed as f64 * 7.3 + joint as f64 * 2.399 + axis as f64 * 1.7) % std::f64::consts::TAU;
        let pace = 0.05 + 0.013 * ((joint * 3 + axis) % 7) as f64;
        (phase + pace * frame as f64).sin()
    };
    let mut joints = Array3::<f32>::zeros((n_frames, N_JOINTS, 3));
    for frame in 0..n_frames {
        let mut places = [[0.0f64; 3]; N_JOINTS];
        for joint in 1..N_JOINTS {
            let Some(parent) = skeleton::parent(joint) else { continue };
            if joint == L_HAND || joint == R_HAND {
                places[joint] = places[parent];
                continue;
            }
            let right = matches!(skeleton::side(joint), skeleton::Side::Right);
            let (root, outwards) = if right { (R_HAND, -1.0) } else { (L_HAND, 1.0) };
            let (aim, loose, metres) = match joint {
                1 | 4 => ([outwards, 0.2, 0.0], 0.3, 0.16),
                2 | 5 => ([0.4 * outwards, 0.6, -0.3], 1.2, 0.28),
                R_WRIST | L_WRIST => ([0.0, 0.0, -1.0], 0.9, 0.25),
                _ => {
                    let finger = (joint - root - 1) / 4;
                    let hand: [f64; 3] = std::array::from_fn(|k| wave(root, k, frame) + [0.0, 0.0, -1.2][k]);
                    let spread = (finger as f64 - 2.0) * 0.25;
                    let metres = if (joint - root) % 4 == 1 { 0.07 } else { 0.03 };
                    ([hand[0] + spread, hand[1] - spread, hand[2]], 0.5, metres)
                }
            };
            let direction: [f64; 3] = std::array::from_fn(|k| aim[k] + loose * wave(joint, k, frame));
            let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
            places[joint] = std::array::from_fn(|k| places[parent][k] + direction[k] / length * metres);
        }
        for joint in 0..N_JOINTS {
            (0..3).for_each(|k| joints[[frame, joint, k]] = places[joint][k] as f32);
        }
    }
    Motion::from_joints(FPS, joints)
}
