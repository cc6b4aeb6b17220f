//! One interval of predicted motion beside its ground truth. No metric looks across its borders.

use super::sums::BlockSums;
use ndarray::{ArrayView2, ArrayView3};
use orator_base::math::vec3::Vec3;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;

/// Made and ground truth of the same seconds.
#[derive(Clone, Copy, Debug)]
pub struct MotionPair<'a> {
    /// [T, 49, 3], metres, house axes; angles of head and trunk behind the joints, where they are measured.
    pub predicted: ArrayView3<'a, f32>,
    /// [T, 49, 3], metres; angles as in `predicted`.
    pub ground_truth: ArrayView3<'a, f32>,
    /// [T, 49]: where the real joint was seen (and the predicted one, where it is measured motion as well). What is not
    /// seen is left out everywhere, as is a real joint that is not finite.
    pub mask: ArrayView2<'a, bool>,
    pub fps: FrameRate,
    /// Onsets of the sound in order, seconds from the interval's start (`audio::onset`); `None` without sound.
    pub onsets: Option<&'a [f64]>,
}

/// A [`MotionPair`] in f64 with one mask, cut to the shortest of its arrays.
pub(crate) struct PairedFrames<'a> {
    pub interval: MotionPair<'a>,
    pub predicted: Vec<[Vec3; N_JOINTS]>,
    pub ground_truth: Vec<[Vec3; N_JOINTS]>,
    pub seen: Vec<[bool; N_JOINTS]>,
    /// Frames a second.
    pub fps: f64,
}

impl<'a> PairedFrames<'a> {
    pub(crate) fn new(interval: &MotionPair<'a>) -> Self {
        let frames = |joints: &ArrayView3<f32>| {
            let n_joints = joints.shape()[1];
            let pose = |t: usize| {
                std::array::from_fn(|joint| {
                    std::array::from_fn(|k| if joint < n_joints { f64::from(joints[[t, joint, k]]) } else { f64::NAN })
                })
            };
            (0..joints.shape()[0]).map(pose).collect::<Vec<[Vec3; N_JOINTS]>>()
        };
        let (mut predicted, mut ground_truth) = (frames(&interval.predicted), frames(&interval.ground_truth));
        let n = predicted.len().min(ground_truth.len()).min(interval.mask.nrows());
        predicted.truncate(n);
        ground_truth.truncate(n);
        let n_joints = interval.mask.ncols();
        let seen = |t: usize| {
            std::array::from_fn(|joint: usize| {
                joint < n_joints && interval.mask[[t, joint]] && ground_truth[t][joint].iter().all(|v| v.is_finite())
            })
        };
        let seen = (0..n).map(seen).collect();
        Self { interval: *interval, predicted, ground_truth, seen, fps: interval.fps.per_sec() }
    }

    pub(crate) fn n_frames(&self) -> usize {
        self.seen.len()
    }

    /// Whether the joint is seen in all of `n` frames from `t` on; false where the interval ends.
    pub(crate) fn sees(&self, t: usize, n: usize, joint: usize) -> bool {
        self.seen.get(t..t + n).is_some_and(|frames| frames.iter().all(|seen| seen[joint]))
    }

    /// By block the frames in which all of `joints` are seen.
    pub(crate) fn whole_frames(&self, joints: &[usize], blocks: &BlockSums) -> Vec<Vec<usize>> {
        let mut frames = vec![Vec::new(); blocks.n()];
        for t in (0..self.n_frames()).filter(|t| joints.iter().all(|joint| self.seen[*t][*joint])) {
            frames[blocks.of(t)].push(t);
        }
        frames
    }

    /// How many seen joints of the predicted motion are not finite in frame `t`.
    pub(crate) fn n_broken(&self, t: usize) -> usize {
        let joints = self.predicted[t].iter().zip(&self.seen[t]);
        joints.filter(|(p, seen)| **seen && p.iter().any(|v| !v.is_finite())).count()
    }
}
