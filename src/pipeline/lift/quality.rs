//! Figures of a lifted clip that need no truth: how steady its bones and wrists are, how far forward its elbows, and
//! whether the pose agrees with the picture it was lifted from. A forearm that looks longer in the picture than it is
//! in 3D was shortened; the ratio of the two lengths says so (perspective alone makes it 0.8 to 0.9 at arm's length).

use anyhow::{Result, ensure};
use orator_base::math::order::{self, Ordered};
use orator_base::types::pose2d::{Keypoints, SEEN_SCORE, coco};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton;
use orator_base::types::skeleton::{L_ELBOW, L_HAND, L_SHOULDER, L_WRIST, N_HAND_JOINTS};

const MM: f64 = 1000.0;

/// Figures of one arm; NaN where the clip shows nothing to measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmFigures {
    /// Median lengths in 3D.
    pub upper_arm_metres: f64,
    pub forearm_metres: f64,
    /// Standard deviation over mean of the bone's length, percent.
    pub upper_arm_spread: f64,
    pub forearm_spread: f64,
    /// Median length of the wrist's second difference, mm a frame a frame: over the clip, and over the second in which
    /// this wrist moves least.
    pub jitter_mm: f64,
    pub still_jitter_mm: f64,
    /// Mean depth of elbow and wrist behind their shoulder, mm; negative is forward.
    pub elbow_z_mm: f64,
    pub wrist_z_mm: f64,
    /// Length in 3D over length in the picture (at the body's scale in that frame): median, and the value that one frame
    /// in twenty falls below.
    pub upper_arm_ratio: [f64; 2],
    pub forearm_ratio: [f64; 2],
    /// Median distance of the wrist in the picture from where the 3D pose puts it, mm at the body's scale.
    pub wrist_off_mm: f64,
    /// Share of frames in which the wrist has no place, and in which it was not seen (filled places included).
    pub missing: f64,
    pub masked: f64,
    /// Share of hand joints that have a place, and that were seen.
    pub hand_there: f64,
    pub hand_seen: f64,
}

/// Figures of a clip: its left arm, its right arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipFigures {
    pub left: ArmFigures,
    pub right: ArmFigures,
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

/// Measures a motion against the keypoints it was lifted from. Errors: no frames, unequal lengths.
pub fn measure(motion: &Motion, keypoints: &Keypoints) -> Result<ClipFigures> {
    let (n_frames, n_keypoints) = (motion.n_frames(), keypoints.n_frames());
    ensure!(n_frames > 0, "the motion has no frames");
    ensure!(n_frames == n_keypoints, "the motion has {n_frames} frames, the keypoints {n_keypoints}");
    let fits: Vec<Option<Fit>> = (0..n_frames).map(|t| Fit::of(motion, keypoints, t)).collect();
    Ok(ClipFigures { left: arm(&LEFT, motion, keypoints, &fits), right: arm(&RIGHT, motion, keypoints, &fits) })
}

/// Median over a second around each frame of the second difference of a joint, mm; NaN where it is missing.
pub fn jitter_around(motion: &Motion, joint: usize, frame_idx: usize) -> f64 {
    let half = (motion.fps.per_sec() / 2.0).round() as usize;
    let range = frame_idx.saturating_sub(half)..(frame_idx + half + 1).min(motion.n_frames());
    median(range.filter_map(|t| second_difference(motion, joint, t)))
}

fn arm(chain: &ArmChain, motion: &Motion, keypoints: &Keypoints, fits: &[Option<Fit>]) -> ArmFigures {
    let n_frames = motion.n_frames();
    let [shoulder, elbow, wrist] = chain.joints;
    let all = |of: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..n_frames).map(of).filter(|v| v.is_finite()).collect() };
    let length = |from: usize, to: usize, t: usize| distance(&position(motion, from, t), &position(motion, to, t));
    let depth = |joint: usize| mean(&all(&|t| MM * (position(motion, joint, t)[2] - position(motion, shoulder, t)[2])));
    let ratio = |bone: usize| {
        let in_picture = |t: usize| -> Option<f64> {
            let [from, to] = [0, 1].map(|end| found(keypoints, chain.points[bone + end], t));
            let ((from, to), fit) = ((from?, to?), fits[t].as_ref()?);
            let seen = distance(&from, &to) / fit.scale;
            (seen > 0.02).then(|| length(chain.joints[bone], chain.joints[bone + 1], t) / seen)
        };
        let ratios = Ordered::new((0..n_frames).filter_map(in_picture));
        [ratios.median(), ratios.low_end(20)].map(|ratio| ratio.unwrap_or(f64::NAN))
    };
    let off = |t: usize| -> Option<f64> {
        let (seen, fit) = (found(keypoints, chain.points[2], t)?, fits[t].as_ref()?);
        Some(MM * distance(&seen, &fit.project(position(motion, wrist, t))) / fit.scale)
    };
    let share = |count: usize, of: usize| count as f64 / of.max(1) as f64;
    let frames = |holds: &dyn Fn(usize) -> bool| share((0..n_frames).filter(|&t| holds(t)).count(), n_frames);
    let hand: Vec<(usize, usize)> = (0..n_frames)
        .flat_map(|t| (1..N_HAND_JOINTS).map(move |j| (t, chain.hand + j)))
        .filter(|&(t, joint)| position(motion, joint, t)[0].is_finite())
        .collect();
    let n_hand = n_frames * (N_HAND_JOINTS - 1);
    ArmFigures {
        upper_arm_metres: median(all(&|t| length(shoulder, elbow, t))),
        forearm_metres: median(all(&|t| length(elbow, wrist, t))),
        upper_arm_spread: spread(&all(&|t| length(shoulder, elbow, t))),
        forearm_spread: spread(&all(&|t| length(elbow, wrist, t))),
        jitter_mm: median((0..n_frames).filter_map(|t| second_difference(motion, wrist, t))),
        still_jitter_mm: still_jitter(motion, wrist),
        elbow_z_mm: depth(elbow),
        wrist_z_mm: depth(wrist),
        upper_arm_ratio: ratio(0),
        forearm_ratio: ratio(1),
        wrist_off_mm: median((0..n_frames).filter_map(off)),
        missing: frames(&|t| !position(motion, wrist, t)[0].is_finite()),
        masked: frames(&|t| !motion.mask[[t, wrist]]),
        hand_there: share(hand.len(), n_hand),
        hand_seen: share(hand.iter().filter(|&&(t, joint)| motion.mask[[t, joint]]).count(), n_hand),
    }
}

/// How the body of one frame lies in the picture: `px = scale * metres + shift`, the least squares over shoulders,
/// elbows and wrists.
struct Fit {
    scale: f64,
    shift: [f64; 2],
}

impl Fit {
    /// `None` with fewer than three points, or where they show no size.
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

/// Median second difference over the second in which the joint moves least, mm; NaN in a clip shorter than that.
fn still_jitter(motion: &Motion, joint: usize) -> f64 {
    let second = (motion.fps.per_sec().round() as usize).max(3);
    let step = |t: usize| MM * distance(&position(motion, joint, t), &position(motion, joint, t + 1));
    let moves = |start: &usize| (*start..*start + second - 1).map(step).sum::<f64>();
    let starts = 0..(motion.n_frames() + 1).saturating_sub(second);
    let stillest = starts.filter(|start| moves(start).is_finite()).min_by(|a, b| moves(a).total_cmp(&moves(b)));
    let Some(start) = stillest else { return f64::NAN };
    median((start + 1..start + second - 1).filter_map(|t| second_difference(motion, joint, t)))
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
    (score > SEEN_SCORE).then_some([f64::from(x), f64::from(y)])
}

fn distance<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard deviation over mean, percent.
fn spread(values: &[f64]) -> f64 {
    let mean = mean(values);
    100.0 * (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt() / mean
}

fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    order::median(values).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array3;
    use orator_base::types::time::FrameRate;

    /// Arms of 0.3 and 0.25 m hanging, forearms pointing `forward` (0..1 of their length) at the camera; the left wrist
    /// shakes by 2 mm from frame 20 on. Seen at 500 px a metre without perspective.
    fn clip(forward: f32) -> (Motion, Keypoints) {
        let n_frames = 60;
        let mut joints = Array3::zeros((n_frames, skeleton::N_JOINTS, 3));
        let mut body = Array3::zeros((n_frames, 17, 3));
        for t in 0..n_frames {
            for (side, chain) in [(1.0, &LEFT), (-1.0, &RIGHT)] {
                let shake = if side > 0.0 && t >= 20 { 0.001 * (1.0 - 2.0 * (t % 2) as f32) } else { 0.0 };
                let down = 0.3 + 0.25 * (1.0 - forward * forward).sqrt();
                let places = [[0.0, 0.0], [0.3, -0.05], [down, -0.05 - 0.25 * forward]];
                for (k, [y, z]) in places.into_iter().enumerate() {
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
        let keypoints = Keypoints { fps, image_size: [640, 480], body, left_hand: hand.clone(), right_hand: hand };
        (Motion::from_joints(fps, joints), keypoints)
    }

    #[test]
    fn a_known_clip_gives_known_figures() {
        let (motion, keypoints) = clip(0.6);
        let figures = measure(&motion, &keypoints).unwrap();
        let near = |a: f64, b: f64, by: f64| assert!((a - b).abs() < by, "{a} for {b}");
        near(figures.left.jitter_mm, 4.0, 0.01);
        near(figures.left.still_jitter_mm, 0.0, 0.01);
        near(figures.right.jitter_mm, 0.0, 0.01);
        near(figures.right.elbow_z_mm, -50.0, 0.1);
        near(figures.left.wrist_z_mm, -200.0, 0.1);
        near(figures.right.forearm_ratio[0], 1.25, 0.02);
        near(figures.left.forearm_metres, 0.25, 1e-4);
        near(figures.left.wrist_off_mm, 0.0, 0.1);
        near(figures.right.forearm_spread, 0.0, 0.01);
        assert_eq!((figures.left.missing, figures.left.masked, figures.left.hand_there), (0.0, 0.0, 1.0));
    }

    #[test]
    fn what_is_missing_counts_as_missing() {
        let (mut motion, keypoints) = clip(0.0);
        motion.joints.slice_mut(ndarray::s![..15, .., ..]).fill(f32::NAN);
        motion.mask.slice_mut(ndarray::s![..30, ..]).fill(false);
        let figures = measure(&motion, &keypoints).unwrap();
        assert_eq!((figures.right.missing, figures.right.masked, figures.right.hand_seen), (0.25, 0.5, 0.5));
        motion.joints.fill(f32::NAN);
        assert!(measure(&motion, &keypoints).unwrap().left.jitter_mm.is_nan());
        let (short, _) = clip(0.0);
        let cut = Motion::from_joints(short.fps, short.joints.slice(ndarray::s![..9, .., ..]).to_owned());
        assert!(measure(&cut, &keypoints).is_err());
    }
}
