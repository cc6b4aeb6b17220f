//! Arms in 3D: the nine points of the upper body from COCO keypoints, through the body lifter, to bones' directions.

use super::gaps::long_gaps;
use crate::motion::upper_body::{
    L_ELBOW, L_HIP, L_SHOULDER, L_WRIST, N_POINTS, NOSE, Pose, R_ELBOW, R_HIP, R_SHOULDER, R_WRIST, Seen, size,
};
use crate::motion::vec3::{self, Vec3};
use crate::nn::body_lifter::BodyLifter;
use crate::types::interval::Interval;
use crate::types::pose2d::{Keypoints, coco};
use anyhow::Result;

/// Frames a second that the lifter was trained on.
pub const TRAINED_FPS: f64 = 15.0;
/// A body keypoint counts as seen from this score on.
const SEEN_SCORE: f32 = 0.3;
/// A measured proportion counts this much, that of the common adult the rest: lifted bones are a little short where
/// they point at the camera.
const TRUST: f64 = 0.5;
/// Frames before and after that a body's apparent size is taken over.
const SIZE_FRAMES: usize = 15;

/// COCO index of each of the nine points.
const COCO: [usize; N_POINTS] = [
    coco::NOSE,
    coco::R_SHOULDER,
    coco::R_ELBOW,
    coco::R_WRIST,
    coco::L_SHOULDER,
    coco::L_ELBOW,
    coco::L_WRIST,
    coco::R_HIP,
    coco::L_HIP,
];

/// Lengths of the arms' bones in metres, the same on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmLengths {
    pub shoulders: f64,
    pub upper_arm: f64,
    pub forearm: f64,
}

impl ArmLengths {
    /// The common adult, of the reference size (`upper_body::REFERENCE_SIZE`).
    pub const MEAN: Self = Self { shoulders: 0.354, upper_arm: 0.293, forearm: 0.253 };

    fn sum(self) -> f64 {
        self.shoulders + self.upper_arm + self.forearm
    }

    /// The three shares grown to the reference size.
    fn to_reference(self) -> Self {
        let grow = Self::MEAN.sum() / self.sum();
        Self { shoulders: self.shoulders * grow, upper_arm: self.upper_arm * grow, forearm: self.forearm * grow }
    }
}

/// The upper body over an interval: poses in px, `None` where it cannot be told, a point NaN where it cannot; the whole
/// pose's size in px (`upper_body::size`); and which points were seen.
pub struct Body {
    pub poses: Vec<Option<Pose>>,
    pub sizes: Vec<f64>,
    pub seen: Vec<[bool; N_POINTS]>,
}

/// Lifts the body over an interval. A wrist that the body model misses is taken from the hand model; a point missing
/// for more than `max_gap` frames is not told, nor is what hangs on it.
pub fn lift(lifter: &BodyLifter, keypoints: &Keypoints, interval: Interval, max_gap: usize) -> Result<Body> {
    let step = keypoints.fps.per_sec() / TRAINED_FPS;
    let points: Vec<Seen> = (interval.start..interval.end).map(|t| seen_points(keypoints, t)).collect();
    let mut poses = lifter.poses(&points, step)?;
    let sizes = poses.iter().map(|p| p.as_ref().map_or(f64::NAN, size)).collect();
    let missing_long: [Vec<bool>; N_POINTS] =
        std::array::from_fn(|j| long_gaps(&points.iter().map(|p| p[j].is_some()).collect::<Vec<_>>(), max_gap));
    for (t, pose) in poses.iter_mut().enumerate() {
        let Some(found) = pose else { continue };
        if missing_long[R_SHOULDER][t] || missing_long[L_SHOULDER][t] {
            *pose = None;
            continue;
        }
        for j in 0..N_POINTS {
            if missing_long[j][t] {
                found[j] = [f64::NAN; 3];
            }
        }
    }
    Ok(Body { poses, sizes, seen: points.iter().map(|p| p.map(|p| p.is_some())).collect() })
}

impl Body {
    /// The body's size in px around a frame.
    pub fn size_at(&self, t: usize) -> Option<f64> {
        let end = self.sizes.len().min(t + SIZE_FRAMES + 1);
        median(self.sizes.get(t.saturating_sub(SIZE_FRAMES)..end)?.to_vec())
    }
}

fn seen_points(keypoints: &Keypoints, t: usize) -> Seen {
    let point = |array: &ndarray::Array3<f32>, j: usize| {
        let [x, y, score] = [0, 1, 2].map(|k| array[[t, j, k]]);
        (score >= SEEN_SCORE && x.is_finite() && y.is_finite()).then_some([x, y])
    };
    let mut seen = COCO.map(|j| point(&keypoints.body, j));
    seen[R_WRIST] = seen[R_WRIST].or_else(|| point(&keypoints.right_hand, 0));
    seen[L_WRIST] = seen[L_WRIST].or_else(|| point(&keypoints.left_hand, 0));
    seen
}

/// The arms' bone lengths over bodies of one video: the medians of each bone over the body's size at the time, both
/// sides together, drawn towards the common adult's. Only bones whose ends were seen are measured.
pub fn measure<'a>(bodies: impl Iterator<Item = &'a Body>) -> ArmLengths {
    let (mut shoulders, mut upper, mut fore) = (Vec::new(), Vec::new(), Vec::new());
    for body in bodies {
        for (t, pose) in body.poses.iter().enumerate() {
            let Some(pose) = pose else { continue };
            let Some(size) = body.size_at(t) else { continue };
            let measure = |lengths: &mut Vec<f64>, a: usize, b: usize| {
                if body.seen[t][a] && body.seen[t][b] {
                    lengths.push(vec3::norm(vec3::sub(pose[a], pose[b])) / size);
                }
            };
            measure(&mut shoulders, R_SHOULDER, L_SHOULDER);
            measure(&mut upper, R_SHOULDER, R_ELBOW);
            measure(&mut upper, L_SHOULDER, L_ELBOW);
            measure(&mut fore, R_ELBOW, R_WRIST);
            measure(&mut fore, L_ELBOW, L_WRIST);
        }
    }
    let mean = ArmLengths::MEAN;
    let share = |lengths: Vec<f64>, of_mean: f64| match median(lengths) {
        Some(length) => TRUST * length.clamp(0.6 * of_mean, 1.5 * of_mean) + (1.0 - TRUST) * of_mean,
        None => of_mean,
    };
    ArmLengths {
        shoulders: share(shoulders, mean.shoulders / mean.sum()),
        upper_arm: share(upper, mean.upper_arm / mean.sum()),
        forearm: share(fore, mean.forearm / mean.sum()),
    }
    .to_reference()
}

/// The pose in metres: every bone keeps its direction and is given its length; nose and hips grow as the body of `size`
/// px does. A point that is not told stays so.
pub fn with_lengths(pose: &Pose, size: f64, lengths: &ArmLengths) -> Pose {
    let along = |from: usize, to: usize, length: f64| -> Vec3 {
        let bone = vec3::sub(pose[to], pose[from]);
        if bone.iter().any(|v| v.is_nan()) {
            return [f64::NAN; 3];
        }
        vec3::scale(vec3::unit(bone, 1e-9).unwrap_or([0.0, 1.0, 0.0]), length)
    };
    let mut arms = [[f64::NAN; 3]; N_POINTS];
    arms[L_SHOULDER] = along(R_SHOULDER, L_SHOULDER, lengths.shoulders / 2.0);
    arms[R_SHOULDER] = vec3::scale(arms[L_SHOULDER], -1.0);
    for (shoulder, elbow, wrist) in [(R_SHOULDER, R_ELBOW, R_WRIST), (L_SHOULDER, L_ELBOW, L_WRIST)] {
        arms[elbow] = vec3::add(arms[shoulder], along(shoulder, elbow, lengths.upper_arm));
        arms[wrist] = vec3::add(arms[elbow], along(elbow, wrist, lengths.forearm));
    }
    let grow = lengths.sum() / size;
    for j in [NOSE, R_HIP, L_HIP] {
        arms[j] = vec3::scale(pose[j], grow);
    }
    arms
}

/// The middle of the finite values, the lower of two.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.retain(|v| v.is_finite());
    if values.is_empty() {
        return None;
    }
    let middle = (values.len() - 1) / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
