//! Disturbed motion, and the response of the three Frechet distances (raw poses, `metrics::space::basis`,
//! `metrics::space::embedding`) to each disturbance.

use crate::demo::rule::dataset;
use crate::metrics::distribution::frechet::{Gaussian, frechet, poses};
use crate::metrics::space::{basis, embedding, fixed_rate};
use crate::types::pose3d::Motion;
use crate::types::skeleton::{L_HAND, L_WRIST, N_JOINTS, R_HAND, R_WRIST, is_duplicate, mirror};
use anyhow::Result;
use ndarray::{Array3, Axis, s};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Disturbance of a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Disturbance {
    /// No disturbance: distance of one half of the data from the other.
    None,
    /// White noise on every joint, standard deviation in millimetres.
    NoiseMm(f32),
    /// Random order of the frames within every group of this many.
    Scrambled(usize),
    /// Moving average over this many frames.
    Smoothed(usize),
    /// Constant mean pose.
    MeanPose,
    /// Every second frame only: twice as fast.
    Faster,
    /// Hands in their average shape, relative to their wrists.
    StiffHands,
    /// Left and right exchanged.
    Mirrored,
}

/// Rows of the table, in order.
pub const TABLE: [Disturbance; 16] = [
    Disturbance::None,
    Disturbance::NoiseMm(2.0),
    Disturbance::NoiseMm(5.0),
    Disturbance::NoiseMm(10.0),
    Disturbance::NoiseMm(20.0),
    Disturbance::NoiseMm(50.0),
    Disturbance::Scrambled(3),
    Disturbance::Scrambled(8),
    Disturbance::Scrambled(30),
    Disturbance::Smoothed(5),
    Disturbance::Smoothed(15),
    Disturbance::Smoothed(45),
    Disturbance::MeanPose,
    Disturbance::Faster,
    Disturbance::StiffHands,
    Disturbance::Mirrored,
];

impl std::fmt::Display for Disturbance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::None => write!(f, "nothing (the other half)"),
            Self::NoiseMm(mm) => write!(f, "noise, {mm} mm"),
            Self::Scrambled(n) => write!(f, "frames shuffled within {n}"),
            Self::Smoothed(n) => write!(f, "mean of {n} frames"),
            Self::MeanPose => write!(f, "the mean pose"),
            Self::Faster => write!(f, "twice as fast"),
            Self::StiffHands => write!(f, "stiff hands"),
            Self::Mirrored => write!(f, "mirrored"),
        }
    }
}

impl Disturbance {
    /// Disturbed motion; the neck stays where it is. Deterministic for a given state of `rng`.
    pub fn apply(self, motion: &Motion, rng: &mut ChaCha8Rng) -> Motion {
        let joints = &motion.joints;
        let n = motion.n_frames();
        let mut worse = match self {
            Self::None => joints.clone(),
            Self::NoiseMm(mm) => joints.mapv(|v| v + 1e-3 * mm * rng.sample::<f32, _>(StandardNormal)),
            Self::Scrambled(together) => {
                let mut order: Vec<usize> = (0..n).collect();
                order.chunks_mut(together).for_each(|part| part.shuffle(rng));
                joints.select(Axis(0), &order)
            }
            Self::Smoothed(width) => Array3::from_shape_fn(joints.raw_dim(), |(t, joint, k)| {
                let around = t.saturating_sub(width / 2)..(t + width / 2 + 1).min(n);
                joints.slice(s![around, joint, k]).mean().unwrap_or(0.0)
            }),
            Self::MeanPose => Array3::from_shape_fn(joints.raw_dim(), {
                let mean = joints.mean_axis(Axis(0)).unwrap_or_default();
                move |(_, joint, k)| mean[[joint, k]]
            }),
            Self::Faster => joints.slice(s![..;2, .., ..]).to_owned(),
            Self::StiffHands => stiff(joints),
            Self::Mirrored => Array3::from_shape_fn(joints.raw_dim(), |(t, joint, k)| {
                let v = joints[[t, mirror(joint), k]];
                if k == 0 { -v } else { v }
            }),
        };
        for t in 0..worse.shape()[0] {
            (0..3).for_each(|k| {
                worse[[t, 0, k]] = 0.0;
                worse[[t, L_HAND, k]] = worse[[t, L_WRIST, k]];
                worse[[t, R_HAND, k]] = worse[[t, R_WRIST, k]];
            });
        }
        Motion::from_joints(motion.fps, worse)
    }
}

fn stiff(joints: &Array3<f32>) -> Array3<f32> {
    let mut stiff = joints.clone();
    for (hand, wrist) in [(L_HAND, L_WRIST), (R_HAND, R_WRIST)] {
        for joint in hand..hand + 21 {
            let from_wrist = &joints.slice(s![.., joint, ..]) - &joints.slice(s![.., wrist, ..]);
            let mean = from_wrist.mean_axis(Axis(0)).unwrap_or_default();
            stiff.slice_mut(s![.., joint, ..]).assign(&(&joints.slice(s![.., wrist, ..]) + &mean));
        }
    }
    stiff
}

/// Distances of a disturbed half from the other half.
#[derive(Clone, Copy, Debug)]
pub struct DisturbanceRow {
    pub disturbance: Disturbance,
    /// Distances by raw poses (cm²), basis, embedding.
    pub distances: [f64; 3],
}

/// Table over `motions`: every second one is disturbed, and its distance from the others measured.
pub fn table(motions: &[Motion]) -> Vec<DisturbanceRow> {
    let joints: Vec<usize> = (1..N_JOINTS).filter(|joint| !is_duplicate(*joint)).collect();
    let spaces = |motions: &mut dyn Iterator<Item = Motion>| {
        let mut sets: [Gaussian; 3] = Default::default();
        for motion in motions {
            let (m, mask) = (motion.joints.view(), motion.mask.view());
            sets[0] += &Gaussian::of(poses(m, mask, &joints).view());
            sets[1] += &Gaussian::of(basis::windows(m, mask, motion.fps).view());
            sets[2] += &Gaussian::of(embedding::windows(m, mask, motion.fps).view());
        }
        sets
    };
    let others = spaces(&mut motions.iter().skip(1).step_by(2).cloned());
    let row = |disturbance: Disturbance| {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let own = spaces(&mut motions.iter().step_by(2).map(|motion| disturbance.apply(motion, &mut rng)));
        DisturbanceRow { disturbance, distances: [0, 1, 2].map(|space| frechet(&own[space], &others[space])) }
    };
    TABLE.into_iter().map(row).collect()
}

/// Minutes of the rule-based speaker that no shipped space was trained on.
pub fn unseen(n_minutes: usize) -> Result<Vec<Motion>> {
    const FIRST_SEED: u64 = 900_000;
    let minute = |n: usize| -> Result<Motion> {
        let clips = dataset::clips(1.0 / 60.0, FIRST_SEED + n as u64)?;
        let motion = clips.first().map(dataset::SpokenClip::motion);
        Ok(motion.unwrap_or(Motion::from_joints(fixed_rate::FPS, Array3::zeros((0, N_JOINTS, 3)))))
    };
    (0..n_minutes).map(minute).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_two_fixed_spaces_notice_more_the_worse_it_gets() {
        let rows = table(&unseen(6).unwrap());
        let of = |disturbance: Disturbance, space: usize| {
            rows.iter().find(|row| row.disturbance == disturbance).unwrap().distances[space]
        };
        use Disturbance::{MeanPose, NoiseMm, Scrambled, Smoothed, StiffHands};
        for space in [1, 2] {
            let floor = of(Disturbance::None, space);
            for ladder in [
                [NoiseMm(5.0), NoiseMm(10.0), NoiseMm(20.0), NoiseMm(50.0)],
                [Scrambled(3), Scrambled(8), Scrambled(30), Scrambled(30)],
                [Smoothed(5), Smoothed(15), Smoothed(45), MeanPose],
            ] {
                let distances = ladder.map(|disturbance| of(disturbance, space));
                assert!(distances.is_sorted(), "space {space}, {ladder:?}: {distances:?}");
                assert!(distances[3] > 1.5 * floor, "space {space}, {ladder:?}: {distances:?}, floor {floor}");
            }
            assert!(of(StiffHands, space) > 1.5 * floor, "space {space}");
        }
        let order = of(Scrambled(30), 0) / of(Disturbance::None, 0);
        assert!((order - 1.0).abs() < 1e-6, "single poses know no order: {order}");
    }
}
