//! How good a trained speaker is on intervals it was not trained on, beside predictors that know less: each figure with
//! its interval over blocks of 4 s. The figures themselves are `metrics`, the predictors `predictors`.

use super::bootstrap::{Estimate, draws};
use super::held_out;
use super::predictors::{self, Predicted};
use super::speaker_blocks::{Block, blocks, sum};
use crate::dataset::{Dataset, Split};
use crate::generate::Speaker;
use crate::metrics::energy::MotionEnergy;
use crate::metrics::frechet::{Gaussian, frechet};
use anyhow::{Result, ensure};
use rayon::prelude::*;
use serde::Serialize;

/// Draws behind an interval; a Frechet distance costs more.
pub const N_DRAWS: usize = 1000;
pub const N_FRECHET_DRAWS: usize = 100;

/// A predictor's figures.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub predictor: &'static str,
    /// Shares of correct keypoints, 0..1: all, arms, fingers.
    pub pck: Estimate,
    pub pck_body: Estimate,
    pub pck_hands: Estimate,
    /// Mean absolute error of normalised coordinates.
    pub l1: Estimate,
    /// Square centimetres, of `Table::n_poses` poses each.
    pub frechet: Estimate,
    /// Mean squared speed of the joints as a share of the real one's.
    pub energy: Estimate,
}

/// All predictors on the same intervals.
#[derive(Clone, Debug, Serialize)]
pub struct Table {
    pub speaker: String,
    pub split: &'static str,
    pub n_intervals: usize,
    pub n_blocks: usize,
    pub secs: f64,
    /// Wholly seen poses behind each Frechet distance, made and real alike.
    pub n_poses: usize,
    pub rows: Vec<Row>,
    /// PCK of the model less that of the mean pose, and of itself with the wrong sound, block by block.
    pub over_mean_pose: Estimate,
    pub over_mismatched: Estimate,
}

/// Measures the speaker of a checkpoint on a split of `dataset`.
///
/// # Errors
/// A dataset of another frame rate; a split without intervals.
pub fn evaluate(dataset: &Dataset, speaker: &Speaker, split: Split) -> Result<Table> {
    let (of_dataset, of_speaker) = (dataset.info().fps, speaker.fps());
    ensure!(
        of_dataset == of_speaker,
        "{} moves at {of_dataset}, the checkpoint's speaker at {of_speaker}: it was trained on another dataset",
        dataset.dir().display()
    );
    let normal = &speaker.facts().normalisation;
    let held_out = held_out::read(dataset, &held_out::samples(dataset, split)?, normal)?;
    let predicted = predictors::predict(dataset, speaker, normal, &held_out)?;
    let measured: Vec<(&'static str, Vec<Block>)> =
        predicted.iter().map(|Predicted { name, motions }| (*name, blocks(&held_out, motions, normal))).collect();
    let n_blocks = measured.first().map_or(0, |(_, blocks)| blocks.len());
    let drawn = draws(n_blocks, N_DRAWS);
    let rows = measured.iter().map(|(name, blocks)| row(name, blocks, &drawn)).collect();
    let over = |other: &str| {
        let of = |name: &str| measured.iter().find(|(found, _)| *found == name).map(|(_, blocks)| blocks.as_slice());
        let (own, others) = (of(predictors::MODEL).unwrap_or_default(), of(other).unwrap_or_default());
        let difference = |which: &mut dyn Iterator<Item = usize>| {
            let which: Vec<usize> = which.collect();
            let share = |blocks: &[Block]| sum(blocks, &which, |block| block.correct).share();
            share(own) - share(others)
        };
        let drawn: Vec<f64> = drawn.iter().map(|draw| difference(&mut draw.iter().copied())).collect();
        Estimate::of(difference(&mut (0..n_blocks)), &drawn)
    };
    Ok(Table {
        speaker: speaker.name().to_owned(),
        split: split.name(),
        n_intervals: held_out.len(),
        n_blocks,
        secs: held_out.iter().map(|interval| of_dataset.secs(interval.real.n_frames())).sum(),
        n_poses: measured.first().map_or(0, |(_, blocks)| blocks.iter().map(|block| block.real_poses.n).sum()),
        rows,
        over_mean_pose: over(predictors::MEAN_POSE),
        over_mismatched: over(predictors::MISMATCHED),
    })
}

fn row(predictor: &'static str, blocks: &[Block], drawn: &[Vec<usize>]) -> Row {
    let all: Vec<usize> = (0..blocks.len()).collect();
    let estimate = |drawn: &[Vec<usize>], figure: &(dyn Fn(&[usize]) -> f64 + Sync)| {
        Estimate::of(figure(&all), &drawn.par_iter().map(|draw| figure(draw)).collect::<Vec<_>>())
    };
    let correct = |which: &[usize]| sum(blocks, which, |block| block.correct);
    let energy = |which: &[usize]| {
        let of = |energy: fn(&Block) -> MotionEnergy| sum(blocks, which, energy);
        of(|block| block.made_energy).relative_to(&of(|block| block.real_energy))
    };
    let distance = |which: &[usize]| {
        let of = |poses: fn(&Block) -> &Gaussian| {
            which.iter().fold(Gaussian::default(), |mut all, block| {
                all += poses(&blocks[*block]);
                all
            })
        };
        frechet(&of(|block| &block.made_poses), &of(|block| &block.real_poses))
    };
    Row {
        predictor,
        pck: estimate(drawn, &|which| correct(which).share()),
        pck_body: estimate(drawn, &|which| correct(which).body.share()),
        pck_hands: estimate(drawn, &|which| correct(which).hands.share()),
        l1: estimate(drawn, &|which| sum(blocks, which, |block| block.error).mean()),
        frechet: estimate(&drawn[..N_FRECHET_DRAWS.min(drawn.len())], &distance),
        energy: estimate(drawn, &energy),
    }
}
