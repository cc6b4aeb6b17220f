//! Validation of a network on held-out segments, each with its real previous poses, compared with a constant mean pose.

use super::segments::{SegmentBatch, SegmentLoader};
use crate::train::gan::losses::number;
use crate::train::gan::score;
use anyhow::Result;
use candle_core::{Device, Tensor};
use orator_nn::Mode;
use orator_nn::seq2seq::predict::GesturePredictor;
use serde::{Deserialize, Serialize};

const MAX_SEGMENTS: usize = 256;

pub struct ValidationSegments {
    split: &'static str,
    batches: Vec<SegmentBatch>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SequenceValidation {
    pub split: String,
    pub n_segments: usize,
    /// Mean absolute error of the known features.
    pub l1: f64,
    /// Mean absolute error of the mean pose.
    pub mean_pose_l1: f64,
    /// Mean squared change from pose to pose, relative to the data.
    pub energy: f64,
    /// Mean absolute difference between segments of different audio, relative to real segments.
    pub spread: f64,
    /// Score that selects the best checkpoint, lower is better: `l1 / mean_pose_l1 + |ln(energy)| / 2`.
    pub score: f64,
    /// Message if this network has collapsed.
    pub alarm: Option<String>,
}

/// Sums over batches, each of the network and of what it is compared with: the mean pose (`error`), else the data.
#[derive(Default)]
struct Sums {
    error: [f64; 2],
    change: [f64; 2],
    distance: [f64; 2],
    n_known: f64,
    n_segments: usize,
}

impl ValidationSegments {
    /// At most `MAX_SEGMENTS` evenly spaced held-out segments, or training segments if none is held out, on `device`.
    pub fn new(held_out: &SegmentLoader, train: &SegmentLoader, batch: usize, device: &Device) -> Result<Self> {
        let (split, loader) = if held_out.is_empty() { ("train", train) } else { ("validation", held_out) };
        let n = loader.len().min(MAX_SEGMENTS);
        let chosen: Vec<usize> = (0..n).map(|i| i * loader.len() / n).collect();
        let batches = chosen.chunks(batch).map(|which| Ok(loader.batch(which)?.on(device)?)).collect::<Result<_>>()?;
        Ok(Self { split, batches })
    }

    pub fn validate(&self, network: &dyn GesturePredictor) -> Result<SequenceValidation> {
        let mut sums = Sums::default();
        for batch in &self.batches {
            let predicted = batch.completed(&network.forward(&batch.segment, &mut Mode::Eval)?.detach())?;
            let mean_pose = batch.completed(&predicted.zeros_like()?)?;
            sums.n_known += number(&batch.known.sum_all()?)?;
            sums.n_segments += predicted.dim(0)?;
            for (i, poses) in [&predicted, &mean_pose].into_iter().enumerate() {
                sums.error[i] += number(&(poses - &batch.real)?.abs()?.sum_all()?)?;
            }
            for (i, poses) in [&predicted, &batch.real].into_iter().enumerate() {
                sums.change[i] += number(&differences(poses, 1)?.sqr()?.sum_all()?)?;
                sums.distance[i] += number(&differences(poses, 0)?.abs()?.sum_all()?)?;
            }
        }
        let Sums { error, change, distance, n_known, n_segments } = sums;
        let ratio = |[own, other]: [f64; 2], default: f64| if other > 0.0 { own / other } else { default };
        let (energy, spread) = (ratio(change, 0.0), ratio(distance, 1.0));
        Ok(SequenceValidation {
            split: self.split.to_owned(),
            n_segments,
            l1: error[0] / n_known.max(1.0),
            mean_pose_l1: error[1] / n_known.max(1.0),
            energy,
            spread,
            score: ratio(error, 1.0) + 0.5 * energy.max(1e-6).ln().abs(),
            alarm: score::alarm(energy, spread),
        })
    }
}

/// Differences of consecutive entries along a dimension.
fn differences(x: &Tensor, dim: usize) -> candle_core::Result<Tensor> {
    let n = x.dim(dim)?.saturating_sub(1);
    x.narrow(dim, 1.min(x.dim(dim)?), n)? - x.narrow(dim, 0, n)?
}
