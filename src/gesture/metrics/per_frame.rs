//! Windows of a few consecutive frames in which a point is visible, from which most metrics compute a value, and the
//! mean of these values over all windows.

use super::body_part::{BodyPart, MeasuredPoint};
use super::definition::{Definition, MetricFamily};
use super::pair::PairedFrames;
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::skeleton::N_JOINTS;

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
    /// Frames per second.
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
