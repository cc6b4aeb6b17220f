//! A network on segments it was not trained on, each begun with its real poses, beside the pose that never moves from the
//! mean.

use super::segments::{SegmentBatch, SegmentLoader};
use crate::train::gan::losses::number;
use crate::train::gan::score;
use anyhow::Result;
use candle_core::Tensor;
use orator_nn::Mode;
use orator_nn::seq2seq::predict::GesturePredictor;
use serde::{Deserialize, Serialize};

/// Most segments a validation looks at.
const N_SEGMENTS: usize = 256;

/// The segments to validate on.
pub struct ValidationSegments {
    split: &'static str,
    batches: Vec<SegmentBatch>,
}

/// What a validation says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SequenceValidation {
    /// Split they were measured on.
    pub split: String,
    pub n_segments: usize,
    /// Mean absolute error of the numbers, and that of the mean pose.
    pub l1: f64,
    pub mean_pose_l1: f64,
    /// Mean squared change from pose to pose, as a share of the data's.
    pub energy: f64,
    /// How far segments of different sound lie apart, as a share of what real segments do.
    pub spread: f64,
    /// What chooses the best checkpoint, lower is better: L1 as a share of the mean pose's, and |ln(energy)| / 2.
    pub score: f64,
    /// Why this network has collapsed, if it has.
    pub alarm: Option<String>,
}

/// Sums over batches: of the network, and of the data.
#[derive(Default)]
struct Sums {
    error: [f64; 2],
    change: [f64; 2],
    apart: [f64; 2],
    n_known: f64,
    n_segments: usize,
}

impl ValidationSegments {
    /// At most `N_SEGMENTS` of the held-out segments, evenly chosen; of those to train on where none is held out.
    pub fn new(held_out: &SegmentLoader, train: &SegmentLoader, batch: usize) -> Result<Self> {
        let (split, loader) = if held_out.is_empty() { ("train", train) } else { ("validation", held_out) };
        let n = loader.len().min(N_SEGMENTS);
        let chosen: Vec<usize> = (0..n).map(|i| i * loader.len() / n).collect();
        let batches = chosen.chunks(batch).map(|which| loader.batch(which)).collect::<Result<_>>()?;
        Ok(Self { split, batches })
    }

    /// The network and the mean pose on the segments.
    pub fn validate(&self, network: &dyn GesturePredictor) -> Result<SequenceValidation> {
        let mut sums = Sums::default();
        for batch in &self.batches {
            let made = batch.completed(&network.forward(&batch.segment, &mut Mode::Eval)?.detach())?;
            let still = batch.completed(&made.zeros_like()?)?;
            sums.n_known += number(&batch.known.sum_all()?)?;
            sums.n_segments += made.dim(0)?;
            for (i, poses) in [&made, &still].into_iter().enumerate() {
                sums.error[i] += number(&(poses - &batch.real)?.abs()?.sum_all()?)?;
            }
            for (i, poses) in [&made, &batch.real].into_iter().enumerate() {
                sums.change[i] += number(&differences(poses, 1)?.sqr()?.sum_all()?)?;
                sums.apart[i] += number(&differences(poses, 0)?.abs()?.sum_all()?)?;
            }
        }
        let Sums { error, change, apart, n_known, n_segments } = sums;
        let share = |[own, real]: [f64; 2], none: f64| if real > 0.0 { own / real } else { none };
        let (energy, spread) = (share(change, 0.0), share(apart, 1.0));
        Ok(SequenceValidation {
            split: self.split.to_owned(),
            n_segments,
            l1: error[0] / n_known.max(1.0),
            mean_pose_l1: error[1] / n_known.max(1.0),
            energy,
            spread,
            score: share(error, 1.0) + 0.5 * energy.max(1e-6).ln().abs(),
            alarm: score::alarm(energy, spread),
        })
    }
}

/// Differences of following entries along a dimension.
fn differences(x: &Tensor, dim: usize) -> candle_core::Result<Tensor> {
    let n = x.dim(dim)?.saturating_sub(1);
    x.narrow(dim, 1.min(x.dim(dim)?), n)? - x.narrow(dim, 0, n)?
}
