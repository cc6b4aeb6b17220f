//! The commonest form of a figure: a number of each frame and point, and their mean over all there are. What the number
//! is stands in the file of each metric.

use super::body_part::{From, Part};
use super::definition::{Definition, Metric};
use super::pair::{Pair, Point};
use super::sums::Blocks;
use crate::types::skeleton::N_JOINTS;

/// Mean over frames and points.
pub(crate) struct Mean {
    definition: Definition,
    points: Vec<From>,
    /// How many frames in a row it looks at.
    n_frames: usize,
    of: fn(&Window) -> f64,
}

/// What such a number is computed from: one point in a few frames in a row, all of them seen.
pub(crate) struct Window<'a> {
    made: &'a [[Point; N_JOINTS]],
    real: &'a [[Point; N_JOINTS]],
    t: usize,
    point: From,
    /// Frames a second.
    pub fps: f64,
}

impl Window<'_> {
    /// Where the made point is in frame `k` of the window.
    pub fn made(&self, k: usize) -> Point {
        self.at(self.made, k)
    }

    /// Where the real point is in frame `k` of the window.
    pub fn real(&self, k: usize) -> Point {
        self.at(self.real, k)
    }

    /// Made less real.
    pub fn apart(&self, k: usize) -> Point {
        less(self.made(k), self.real(k))
    }

    fn at(&self, poses: &[[Point; N_JOINTS]], k: usize) -> Point {
        let pose = &poses[self.t + k];
        match self.point.origin {
            Some(origin) => less(pose[self.point.joint], pose[origin]),
            None => pose[self.point.joint],
        }
    }
}

pub(crate) fn less(a: Point, b: Point) -> Point {
    std::array::from_fn(|k| a[k] - b[k])
}

pub(crate) fn norm(v: Point) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

impl Mean {
    /// Of `of` over all points of `part` and all `n_frames` frames in a row.
    pub fn over(definition: Definition, part: Part, n_frames: usize, of: fn(&Window) -> f64) -> Box<dyn Metric> {
        Box::new(Self { definition, points: part.points(), n_frames, of })
    }
}

impl Metric for Mean {
    fn definitions(&self) -> Vec<Definition> {
        vec![self.definition.clone()]
    }

    fn n_sums(&self) -> usize {
        2
    }

    fn measure(&self, pair: &Pair, blocks: &mut Blocks) {
        for t in 0..(pair.n_frames() + 1).saturating_sub(self.n_frames) {
            let sums = blocks.at(t);
            for &point in &self.points {
                let seen = |joint| pair.sees(t, self.n_frames, joint);
                if seen(point.joint) && point.origin.is_none_or(seen) {
                    sums[0] += (self.of)(&Window { made: &pair.made, real: &pair.real, t, point, fps: pair.fps });
                    sums[1] += 1.0;
                }
            }
        }
    }

    fn values(&self, sums: &[f64]) -> Vec<f64> {
        vec![sums[0] / sums[1]]
    }
}
