//! A predictor's motion beside the real one in blocks of about 4 s, each with its sums.

use super::held_out::HeldOut;
use crate::metrics::energy::MotionEnergy;
use crate::metrics::frechet::{self, Gaussian, poses};
use crate::metrics::pck::Correct;
use crate::train::poses::Normalisation;
use crate::types::pose3d::Motion;
use ndarray::s;
use rayon::prelude::*;
use std::ops::{AddAssign, Range};

/// Length of a block, seconds: an interval has as many as fit best, all of one length.
const BLOCK_SECS: f64 = 4.0;

/// Sums over one block.
pub struct Block {
    pub correct: Correct,
    pub error: Error,
    pub made_energy: MotionEnergy,
    pub real_energy: MotionEnergy,
    pub made_poses: Gaussian,
    pub real_poses: Gaussian,
}

/// Absolute errors of normalised coordinates.
#[derive(Clone, Copy, Debug, Default)]
pub struct Error {
    pub sum: f64,
    pub n: usize,
}

impl Error {
    /// 0 of none.
    pub fn mean(&self) -> f64 {
        self.sum / self.n.max(1) as f64
    }
}

impl AddAssign for Error {
    fn add_assign(&mut self, other: Self) {
        self.sum += other.sum;
        self.n += other.n;
    }
}

/// The sum of a part of the blocks `which`; a block counts as often as it is named.
pub fn sum<T: Default + AddAssign>(blocks: &[Block], which: &[usize], part: impl Fn(&Block) -> T) -> T {
    let mut all = T::default();
    which.iter().filter_map(|i| blocks.get(*i)).for_each(|block| all += part(block));
    all
}

/// The blocks of `made` beside `real`, interval after interval.
pub fn blocks(real: &[HeldOut], made: &[Motion], normal: &Normalisation) -> Vec<Block> {
    let joints = frechet::joints(real.iter().map(|interval| interval.real.mask.view()));
    let of_interval = |(held_out, made): (&HeldOut, &Motion)| {
        let real = &held_out.real;
        let per_block = BLOCK_SECS * real.fps.per_sec();
        let n = ((real.n_frames() as f64 / per_block).round() as usize).max(1);
        let frames = |i: usize| i * real.n_frames() / n..(i + 1) * real.n_frames() / n;
        (0..n).map(|i| block(real, made, frames(i), normal, &joints)).collect::<Vec<_>>()
    };
    real.par_iter().zip(made).flat_map_iter(of_interval).collect()
}

fn block(real: &Motion, made: &Motion, frames: Range<usize>, normal: &Normalisation, joints: &[usize]) -> Block {
    let cut = |motion: &Motion| Motion {
        fps: motion.fps,
        joints: motion.joints.slice(s![frames.clone(), .., ..]).to_owned(),
        mask: motion.mask.slice(s![frames.clone(), ..]).to_owned(),
    };
    let (real, made) = (cut(real), cut(made));
    let mask = real.mask.view();
    let mut correct = Correct::default();
    correct.count(made.joints.view(), real.joints.view(), mask);
    let energy = |motion: &Motion| {
        let mut energy = MotionEnergy::default();
        energy.add(motion.joints.view(), mask, motion.fps);
        energy
    };
    let gaussian = |motion: &Motion| Gaussian::of(poses(motion.joints.view(), mask, joints).view());
    let ((numbers, seen), (made_numbers, _)) = (normal.numbers(&real), normal.numbers(&made));
    let mut error = Error::default();
    for ((i, t), real) in numbers.indexed_iter() {
        if seen[[i / 3, t]] {
            error.sum += f64::from((made_numbers[[i, t]] - real).abs());
            error.n += 1;
        }
    }
    Block {
        correct,
        error,
        made_energy: energy(&made),
        real_energy: energy(&real),
        made_poses: gaussian(&made),
        real_poses: gaussian(&real),
    }
}
