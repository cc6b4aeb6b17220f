//! One interval of made motion beside the real one, as the metrics see it. No metric looks across its borders.

use crate::types::skeleton::N_JOINTS;
use crate::types::time::FrameRate;
use ndarray::{ArrayView2, ArrayView3};

/// Made and real motion of the same seconds.
#[derive(Clone, Copy, Debug)]
pub struct Interval<'a> {
    /// [T, 49, 3], metres, house axes.
    pub made: ArrayView3<'a, f32>,
    /// [T, 49, 3], metres.
    pub real: ArrayView3<'a, f32>,
    /// [T, 49]: where the real joint was seen (and the made one, where it is measured motion as well). What is not
    /// seen is left out everywhere, as is a real joint that is not finite.
    pub mask: ArrayView2<'a, bool>,
    pub fps: FrameRate,
    /// Onsets of the sound in order, seconds from the interval's start (`audio::onset`); `None` without sound.
    pub onsets: Option<&'a [f64]>,
}

/// A place, metres.
pub(crate) type Point = [f64; 3];

/// The same in the form metrics compute with: as many frames as all of it has.
pub(crate) struct Pair<'a> {
    pub interval: Interval<'a>,
    pub made: Vec<[Point; N_JOINTS]>,
    pub real: Vec<[Point; N_JOINTS]>,
    pub seen: Vec<[bool; N_JOINTS]>,
    /// Frames a second.
    pub fps: f64,
}

impl<'a> Pair<'a> {
    pub fn new(interval: &Interval<'a>) -> Self {
        let frames = |joints: &ArrayView3<f32>| {
            let n_joints = joints.shape()[1];
            let pose = |t: usize| {
                std::array::from_fn(|joint| {
                    std::array::from_fn(|k| if joint < n_joints { f64::from(joints[[t, joint, k]]) } else { f64::NAN })
                })
            };
            (0..joints.shape()[0]).map(pose).collect::<Vec<[Point; N_JOINTS]>>()
        };
        let (mut made, mut real) = (frames(&interval.made), frames(&interval.real));
        let n = made.len().min(real.len()).min(interval.mask.nrows());
        made.truncate(n);
        real.truncate(n);
        let n_joints = interval.mask.ncols();
        let seen = |t: usize| {
            std::array::from_fn(|joint: usize| {
                joint < n_joints && interval.mask[[t, joint]] && real[t][joint].iter().all(|v| v.is_finite())
            })
        };
        let seen = (0..n).map(seen).collect();
        Self { interval: *interval, made, real, seen, fps: interval.fps.per_sec() }
    }

    pub fn n_frames(&self) -> usize {
        self.seen.len()
    }

    /// Whether the joint is seen in all of `n` frames from `t` on; false where the interval ends.
    pub fn sees(&self, t: usize, n: usize, joint: usize) -> bool {
        self.seen.get(t..t + n).is_some_and(|frames| frames.iter().all(|seen| seen[joint]))
    }

    /// How many seen joints of the made motion are not finite in frame `t`.
    pub fn n_broken(&self, t: usize) -> usize {
        let joints = self.made[t].iter().zip(&self.seen[t]);
        joints.filter(|(p, seen)| **seen && p.iter().any(|v| !v.is_finite())).count()
    }
}
