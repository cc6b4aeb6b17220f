//! One interval of predicted motion with its ground truth; no metric extends across its borders. Windows of a few
//! frames in which a point is visible, from which most metrics compute a value, and their mean over all windows.

use super::definition::{BodyPart, Definition, MeasuredPoint, MetricFamily};
use super::sums::BlockSums;
use ndarray::{ArrayView2, ArrayView3};
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;

/// Predicted motion and ground truth of the same time interval.
#[derive(Clone, Copy, Debug)]
pub struct MotionPair<'a> {
    /// Joints [T, 49, 3], metres, in the project's axes, followed by the angles of head and trunk if they are measured.
    pub predicted: ArrayView3<'a, f32>,
    /// Joints [T, 49, 3], metres, and angles as in `predicted`.
    pub ground_truth: ArrayView3<'a, f32>,
    /// Mask [T, 49] of the visible real joints (and predicted ones, if they are measured motion too). Joints that are
    /// masked, and real joints that are not finite, are ignored by all metrics.
    pub mask: ArrayView2<'a, bool>,
    pub fps: FrameRate,
    /// Sorted onsets of the sound, seconds from the start of the interval (`audio::onset`); `None` without sound.
    pub onsets: Option<&'a [f64]>,
}

/// A [`MotionPair`] converted to f64, with a combined mask, and cut to the shortest of its arrays.
pub(crate) struct PairedFrames<'a> {
    pub interval: MotionPair<'a>,
    pub predicted: Vec<[Vec3; N_JOINTS]>,
    pub ground_truth: Vec<[Vec3; N_JOINTS]>,
    pub visible: Vec<[bool; N_JOINTS]>,
    /// Frames per second.
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
        let visible = |t: usize| {
            std::array::from_fn(|joint: usize| {
                joint < n_joints && interval.mask[[t, joint]] && ground_truth[t][joint].iter().all(|v| v.is_finite())
            })
        };
        let visible = (0..n).map(visible).collect();
        Self { interval: *interval, predicted, ground_truth, visible, fps: interval.fps.per_sec() }
    }

    pub(crate) fn n_frames(&self) -> usize {
        self.visible.len()
    }

    /// Whether the joint is visible in all `n` frames from `t` on; false beyond the end of the interval.
    pub(crate) fn is_visible(&self, t: usize, n: usize, joint: usize) -> bool {
        self.visible.get(t..t + n).is_some_and(|frames| frames.iter().all(|visible| visible[joint]))
    }

    /// Frames in which all of `joints` are visible, by block.
    pub(crate) fn complete_frames(&self, joints: &[usize], blocks: &BlockSums) -> Vec<Vec<usize>> {
        let mut frames = vec![Vec::new(); blocks.n()];
        for t in (0..self.n_frames()).filter(|t| joints.iter().all(|joint| self.visible[*t][*joint])) {
            frames[blocks.of(t)].push(t);
        }
        frames
    }

    /// Number of visible joints whose prediction is not finite in frame `t`.
    pub(crate) fn n_non_finite(&self, t: usize) -> usize {
        let joints = self.predicted[t].iter().zip(&self.visible[t]);
        joints.filter(|(p, visible)| **visible && p.iter().any(|v| !v.is_finite())).count()
    }
}

/// A point that is visible in a few consecutive frames.
pub(crate) struct PointWindow<'a, 'b> {
    pair: &'a PairedFrames<'b>,
    /// First frame.
    pub t: usize,
    point: MeasuredPoint,
}

/// All windows of `n_frames` frames that start at frame `first` or later, ordered by frame and point.
pub(crate) fn windows<'a, 'b>(
    pair: &'a PairedFrames<'b>,
    points: &'a [MeasuredPoint],
    n_frames: usize,
    first: usize,
) -> impl Iterator<Item = PointWindow<'a, 'b>> {
    let at = move |t: usize| points.iter().map(move |&point| PointWindow { pair, t, point });
    let is_seen = move |window: &PointWindow| {
        let visible = |joint| pair.is_visible(window.t, n_frames, joint);
        visible(window.point.joint) && window.point.origin.is_none_or(visible)
    };
    (first..(pair.n_frames() + 1).saturating_sub(n_frames)).flat_map(at).filter(is_seen)
}

impl PointWindow<'_, '_> {
    pub(crate) fn fps(&self) -> f64 {
        self.pair.fps
    }

    /// Position of the predicted point in frame `k` of the window.
    pub(crate) fn predicted(&self, k: usize) -> Vec3 {
        self.at(&self.pair.predicted, k)
    }

    /// Position of the real point in frame `k` of the window.
    pub(crate) fn ground_truth(&self, k: usize) -> Vec3 {
        self.at(&self.pair.ground_truth, k)
    }

    /// Prediction minus ground truth in frame `k` of the window.
    pub(crate) fn difference(&self, k: usize) -> Vec3 {
        vec3::sub(self.predicted(k), self.ground_truth(k))
    }

    fn at(&self, poses: &[[Vec3; N_JOINTS]], k: usize) -> Vec3 {
        let pose = &poses[self.t + k];
        match self.point.origin {
            Some(origin) => vec3::sub(pose[self.point.joint], pose[origin]),
            None => pose[self.point.joint],
        }
    }
}

/// Metric that averages `of` over all points of `part` and all windows of `n_frames` frames from frame `first` on.
pub(crate) fn mean(
    definition: Definition,
    part: BodyPart,
    n_frames: usize,
    first: usize,
    of: fn(&PointWindow) -> f64,
) -> MetricFamily {
    let points = part.points();
    MetricFamily::mean(definition, move |pair, blocks| {
        for window in windows(pair, &points, n_frames, first) {
            let sums = blocks.at(window.t);
            sums[0] += of(&window);
            sums[1] += 1.0;
        }
    })
}
