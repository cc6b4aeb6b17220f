//! Statistics of a lifted clip that need no ground truth: arm lengths, wrist jitter, reprojection error, visibility.

use anyhow::{Result, ensure};
use orator_base::math::order;
use orator_base::types::pose2d::{Keypoints, VISIBLE_SCORE, coco};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{self, L_ELBOW, L_HAND, L_SHOULDER, L_WRIST, N_HAND_JOINTS};

const MM: f64 = 1000.0;

/// Statistics of one arm; NaN where nothing can be measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmStatistics {
    /// Median lengths in 3D, metres.
    pub upper_arm_metres: f64,
    pub forearm_metres: f64,
    /// Median norm of the second difference of the wrist, mm per frame squared.
    pub jitter_mm: f64,
    /// Median reprojection error of the wrist, mm at the scale of the body.
    pub wrist_off_mm: f64,
    /// Share of frames in which the wrist has no position, and in which it is not visible (filled positions included).
    pub missing: f64,
    pub masked: f64,
    /// Share of hand joints that have a position, and that are visible.
    pub hand_there: f64,
    pub hand_visible: f64,
}

/// Statistics of the left and right arm of a clip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipStatistics {
    pub left: ArmStatistics,
    pub right: ArmStatistics,
}

/// Joints and COCO points of one side.
struct ArmChain {
    joints: [usize; 3],
    points: [usize; 3],
    hand: usize,
}

const LEFT: ArmChain = ArmChain {
    joints: [L_SHOULDER, L_ELBOW, L_WRIST],
    points: [coco::L_SHOULDER, coco::L_ELBOW, coco::L_WRIST],
    hand: L_HAND,
};
const RIGHT: ArmChain = ArmChain {
    joints: [skeleton::R_SHOULDER, skeleton::R_ELBOW, skeleton::R_WRIST],
    points: [coco::R_SHOULDER, coco::R_ELBOW, coco::R_WRIST],
    hand: skeleton::R_HAND,
};

/// Compares a motion with the keypoints that it was lifted from.
///
/// # Errors
/// No frames; unequal numbers of frames.
pub fn measure(motion: &Motion, keypoints: &Keypoints) -> Result<ClipStatistics> {
    let (n_frames, n_keypoints) = (motion.n_frames(), keypoints.n_frames());
    ensure!(n_frames > 0, "the motion has no frames");
    ensure!(n_frames == n_keypoints, "the motion has {n_frames} frames, the keypoints {n_keypoints}");
    Ok(ClipStatistics { left: arm(&LEFT, motion, keypoints), right: arm(&RIGHT, motion, keypoints) })
}

/// Median norm of the second difference of a joint over the second around a frame, mm; NaN if the joint is missing.
pub fn jitter_around(motion: &Motion, joint: usize, frame_idx: usize) -> f64 {
    let half = (motion.fps.per_sec() / 2.0).round() as usize;
    let range = frame_idx.saturating_sub(half)..(frame_idx + half + 1).min(motion.n_frames());
    median(range.filter_map(|t| second_difference(motion, joint, t)))
}

fn arm(chain: &ArmChain, motion: &Motion, keypoints: &Keypoints) -> ArmStatistics {
    let n_frames = motion.n_frames();
    let [shoulder, elbow, wrist] = chain.joints;
    let length = |from: usize, to: usize| {
        let lengths = (0..n_frames).map(|t| distance(&position(motion, from, t), &position(motion, to, t)));
        median(lengths.filter(|length| length.is_finite()))
    };
    let wrist_error = |t: usize| -> Option<f64> {
        let (keypoint, fit) = (found(keypoints, chain.points[2], t)?, Fit::of(motion, keypoints, t)?);
        Some(MM * distance(&keypoint, &fit.project(position(motion, wrist, t))) / fit.scale)
    };
    let share = |count: usize, of: usize| count as f64 / of.max(1) as f64;
    let frames = |holds: &dyn Fn(usize) -> bool| share((0..n_frames).filter(|&t| holds(t)).count(), n_frames);
    let hand: Vec<(usize, usize)> = (0..n_frames)
        .flat_map(|t| (1..N_HAND_JOINTS).map(move |j| (t, chain.hand + j)))
        .filter(|&(t, joint)| position(motion, joint, t)[0].is_finite())
        .collect();
    let n_hand = n_frames * (N_HAND_JOINTS - 1);
    ArmStatistics {
        upper_arm_metres: length(shoulder, elbow),
        forearm_metres: length(elbow, wrist),
        jitter_mm: median((0..n_frames).filter_map(|t| second_difference(motion, wrist, t))),
        wrist_off_mm: median((0..n_frames).filter_map(wrist_error)),
        missing: frames(&|t| !position(motion, wrist, t)[0].is_finite()),
        masked: frames(&|t| !motion.mask[[t, wrist]]),
        hand_there: share(hand.len(), n_hand),
        hand_visible: share(hand.iter().filter(|&&(t, joint)| motion.mask[[t, joint]]).count(), n_hand),
    }
}

/// Weak-perspective projection of one frame: `px = scale * metres + shift`, least squares over the arms.
struct Fit {
    scale: f64,
    shift: [f64; 2],
}

impl Fit {
    /// Fits the projection; `None` with fewer than three points or a degenerate scale.
    fn of(motion: &Motion, keypoints: &Keypoints, t: usize) -> Option<Self> {
        let pairs: Vec<([f64; 3], [f64; 2])> = [&LEFT, &RIGHT]
            .iter()
            .flat_map(|chain| chain.joints.iter().zip(&chain.points))
            .filter_map(|(&joint, &point)| Some((position(motion, joint, t), found(keypoints, point, t)?)))
            .filter(|(joint, _)| joint.iter().all(|v| v.is_finite()))
            .collect();
        let n = pairs.len() as f64;
        let middle = |axis: usize| {
            let sum = pairs.iter().fold([0.0; 2], |[a, b], (joint, point)| [a + joint[axis], b + point[axis]]);
            sum.map(|v| v / n)
        };
        let middles = [middle(0), middle(1)];
        let (mut across, mut square) = (0.0, 0.0);
        for (joint, point) in &pairs {
            for (axis, [of_joint, of_point]) in middles.iter().enumerate() {
                across += (joint[axis] - of_joint) * (point[axis] - of_point);
                square += (joint[axis] - of_joint).powi(2);
            }
        }
        let scale = across / square;
        let shift = middles.map(|[of_joint, of_point]| of_point - scale * of_joint);
        (pairs.len() >= 3 && scale.is_finite() && scale > 1.0).then_some(Self { scale, shift })
    }

    fn project(&self, joint: [f64; 3]) -> [f64; 2] {
        [0, 1].map(|axis| self.scale * joint[axis] + self.shift[axis])
    }
}

/// |x(t - 1) - 2 x(t) + x(t + 1)| in mm, where all three are known.
fn second_difference(motion: &Motion, joint: usize, t: usize) -> Option<f64> {
    if t == 0 || t + 1 >= motion.n_frames() {
        return None;
    }
    let [before, at, after] = [t - 1, t, t + 1].map(|t| position(motion, joint, t));
    let square: f64 = (0..3).map(|k| (before[k] - 2.0 * at[k] + after[k]).powi(2)).sum();
    Some(MM * square.sqrt()).filter(|v| v.is_finite())
}

fn position(motion: &Motion, joint: usize, t: usize) -> [f64; 3] {
    std::array::from_fn(|k| f64::from(motion.joints[[t, joint, k]]))
}

fn found(keypoints: &Keypoints, point: usize, t: usize) -> Option<[f64; 2]> {
    let [x, y, score] = [0, 1, 2].map(|k| keypoints.body[[t, point, k]]);
    (score > VISIBLE_SCORE).then_some([f64::from(x), f64::from(y)])
}

fn distance<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    order::median(values).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array3;
    use orator_base::types::time::FrameRate;

    /// Hanging arms of 0.3 and 0.25 m, the forearms bent toward the camera; the left wrist shakes by 2 mm.
    /// Orthographic projection at 500 px per metre.
    fn clip() -> (Motion, Keypoints) {
        let n_frames = 60;
        let mut joints = Array3::zeros((n_frames, skeleton::N_JOINTS, 3));
        let mut body = Array3::zeros((n_frames, 17, 3));
        for t in 0..n_frames {
            for (side, chain) in [(1.0, &LEFT), (-1.0, &RIGHT)] {
                let shake = if side > 0.0 { 0.001 * (1.0 - 2.0 * (t % 2) as f32) } else { 0.0 };
                let positions = [[0.0, 0.0], [0.3, -0.05], [0.5, -0.2]];
                for (k, [y, z]) in positions.into_iter().enumerate() {
                    let x = side * 0.17 + if k == 2 { shake } else { 0.0 };
                    for (axis, v) in [x, y, z].into_iter().enumerate() {
                        joints[[t, chain.joints[k], axis]] = v;
                    }
                    for (axis, v) in [500.0 * x + 300.0, 500.0 * y + 200.0, 1.0].into_iter().enumerate() {
                        body[[t, chain.points[k], axis]] = v;
                    }
                }
            }
        }
        let hand = Array3::zeros((n_frames, 21, 3));
        let fps = FrameRate::new(15, 1);
        let keypoints = Keypoints {
            fps,
            image_size: [640, 480],
            body,
            left_hand: hand.clone(),
            right_hand: hand,
            hand_depth: None,
        };
        (Motion::from_joints(fps, joints), keypoints)
    }

    #[test]
    fn a_known_clip_gives_known_statistics() {
        let (motion, keypoints) = clip();
        let ClipStatistics { left, right } = measure(&motion, &keypoints).unwrap();
        let near = |a: f64, b: f64, by: f64| assert!((a - b).abs() < by, "{a} for {b}");
        near(left.jitter_mm, 4.0, 0.01);
        near(right.jitter_mm, 0.0, 0.01);
        near(left.forearm_metres, 0.25, 1e-4);
        near(left.wrist_off_mm, 0.0, 0.1);
        assert_eq!((left.missing, left.masked, left.hand_there), (0.0, 0.0, 1.0));
    }

    #[test]
    fn missing_joints_are_counted() {
        let (mut motion, keypoints) = clip();
        motion.joints.slice_mut(ndarray::s![..15, .., ..]).fill(f32::NAN);
        motion.mask.slice_mut(ndarray::s![..30, ..]).fill(false);
        let right = measure(&motion, &keypoints).unwrap().right;
        assert_eq!((right.missing, right.masked, right.hand_visible), (0.25, 0.5, 0.5));
        motion.joints.fill(f32::NAN);
        assert!(measure(&motion, &keypoints).unwrap().left.jitter_mm.is_nan());
        let (short, _) = clip();
        let cut = Motion::from_joints(short.fps, short.joints.slice(ndarray::s![..9, .., ..]).to_owned());
        assert!(measure(&cut, &keypoints).is_err());
    }
}
