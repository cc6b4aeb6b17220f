//! Windows of a few frames in a row in which one point is seen: what most metrics take a number of, and the mean of
//! these numbers over all there are.

use super::body_part::{BodyPart, MeasuredPoint};
use super::definition::{Definition, MetricFamily};
use super::pair::PairedFrames;
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::skeleton::N_JOINTS;

/// One point in a few frames in a row, all of them seen.
pub(crate) struct PointWindow<'a, 'b> {
    pair: &'a PairedFrames<'b>,
    /// First frame.
    pub t: usize,
    point: MeasuredPoint,
}

/// All windows of `n_frames` frames from frame `first` on, by frame and point.
pub(crate) fn windows<'a, 'b>(
    pair: &'a PairedFrames<'b>,
    points: &'a [MeasuredPoint],
    n_frames: usize,
    first: usize,
) -> impl Iterator<Item = PointWindow<'a, 'b>> {
    let at = move |t: usize| points.iter().map(move |&point| PointWindow { pair, t, point });
    let is_seen = move |window: &PointWindow| {
        let seen = |joint| pair.sees(window.t, n_frames, joint);
        seen(window.point.joint) && window.point.origin.is_none_or(seen)
    };
    (first..(pair.n_frames() + 1).saturating_sub(n_frames)).flat_map(at).filter(is_seen)
}

impl PointWindow<'_, '_> {
    /// Frames a second.
    pub(crate) fn fps(&self) -> f64 {
        self.pair.fps
    }

    /// Position of the predicted point in frame `k` of the window.
    pub(crate) fn predicted(&self, k: usize) -> Vec3 {
        self.at(&self.pair.predicted, k)
    }

    /// Where the real point is in frame `k` of the window.
    pub(crate) fn ground_truth(&self, k: usize) -> Vec3 {
        self.at(&self.pair.ground_truth, k)
    }

    /// Prediction minus ground truth.
    pub(crate) fn apart(&self, k: usize) -> Vec3 {
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

/// Mean of `of` over all points of `part` and all `n_frames` frames in a row from frame `first` on.
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
