//! The commonest form of a metric: a number of each frame and point, and their mean over all there are. What the number
//! is stands in the file of each metric.

use super::body_part::{BodyPart, MeasuredPoint};
use super::definition::{Definition, MetricFamily};
use super::pair::PairedFrames;
use super::sums::BlockSums;
use crate::math::vec3;
use crate::math::vec3::Vec3;
use crate::types::skeleton::N_JOINTS;

/// Mean over frames and points.
pub(crate) struct FrameMean {
    definition: Definition,
    points: Vec<MeasuredPoint>,
    /// How many frames in a row it looks at.
    n_frames: usize,
    of: fn(&PointWindow) -> f64,
}

/// What such a number is computed from: one point in a few frames in a row, all of them seen.
pub(crate) struct PointWindow<'a> {
    predicted: &'a [[Vec3; N_JOINTS]],
    ground_truth: &'a [[Vec3; N_JOINTS]],
    t: usize,
    point: MeasuredPoint,
    /// Frames a second.
    pub fps: f64,
}

impl PointWindow<'_> {
    /// Position of the predicted point in frame `k` of the window.
    pub fn predicted(&self, k: usize) -> Vec3 {
        self.at(self.predicted, k)
    }

    /// Where the real point is in frame `k` of the window.
    pub fn ground_truth(&self, k: usize) -> Vec3 {
        self.at(self.ground_truth, k)
    }

    /// Prediction minus ground truth.
    pub fn apart(&self, k: usize) -> Vec3 {
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

impl FrameMean {
    /// Of `of` over all points of `part` and all `n_frames` frames in a row.
    pub fn over(
        definition: Definition,
        part: BodyPart,
        n_frames: usize,
        of: fn(&PointWindow) -> f64,
    ) -> Box<dyn MetricFamily> {
        Box::new(Self { definition, points: part.points(), n_frames, of })
    }
}

impl MetricFamily for FrameMean {
    fn definitions(&self) -> Vec<Definition> {
        vec![self.definition.clone()]
    }

    fn n_sums(&self) -> usize {
        2
    }

    fn measure(&self, pair: &PairedFrames, blocks: &mut BlockSums) {
        for t in 0..(pair.n_frames() + 1).saturating_sub(self.n_frames) {
            let sums = blocks.at(t);
            for &point in &self.points {
                let seen = |joint| pair.sees(t, self.n_frames, joint);
                if seen(point.joint) && point.origin.is_none_or(seen) {
                    sums[0] += (self.of)(&PointWindow {
                        predicted: &pair.predicted,
                        ground_truth: &pair.ground_truth,
                        t,
                        point,
                        fps: pair.fps,
                    });
                    sums[1] += 1.0;
                }
            }
        }
    }

    fn values(&self, sums: &[f64]) -> Vec<f64> {
        vec![sums[0] / sums[1]]
    }
}
