//! The generator on windows it was not trained on, beside the pose that never moves from the mean.

use super::examples::{Batch, Examples};
use super::losses;
use super::metrics::{Figures, Validation};
use super::poses::{N_NUMBERS, Normalisation};
use crate::config::Gan;
use crate::dataset::{Dataset, Split};
use crate::metrics::pck::Correct;
use crate::nn::unet::Generator;
use crate::stage::progress::Progress;
use crate::types::skeleton::{L_HAND, L_WRIST, N_JOINTS, NECK, R_HAND, R_WRIST};
use anyhow::Result;
use candle_core::Tensor;
use ndarray::{Array2, ArrayView2};

/// Most windows a validation looks at.
const N_WINDOWS: usize = 256;

/// The windows to validate on.
pub struct HeldOut {
    split: Split,
    n_frames: usize,
    batches: Vec<Batch>,
}

impl HeldOut {
    /// Windows side by side, at most `N_WINDOWS` evenly chosen: of the validation split, or where that has none of the
    /// training split, which is said.
    pub fn load(dataset: &Dataset, settings: &Gan, normal: &Normalisation, progress: &dyn Progress) -> Result<Self> {
        let n_frames = settings.window_frames;
        let mut split = Split::Validation;
        let mut examples = Examples::load(dataset, split, normal, n_frames, n_frames)?;
        if examples.is_empty() {
            progress.say("the dataset has no validation window: the figures below are on training windows");
            split = Split::Train;
            examples = Examples::load(dataset, split, normal, n_frames, n_frames)?;
        }
        let n = examples.len().min(N_WINDOWS);
        let chosen: Vec<usize> = (0..n).map(|i| i * examples.len() / n).collect();
        let batches = chosen.chunks(settings.batch).map(|which| examples.batch(which)).collect::<Result<_>>()?;
        Ok(Self { split, n_frames, batches })
    }

    /// Both predictors on the same windows.
    pub fn validate(&self, generator: &Generator, normal: &Normalisation) -> Result<Validation> {
        let (mut made, mut still) = (Tally::default(), Tally::default());
        let mut n_windows = 0;
        for batch in &self.batches {
            let poses = generator.forward(&batch.mels, self.n_frames, false)?.detach();
            made.add(&poses, batch, normal)?;
            still.add(&poses.zeros_like()?, batch, normal)?;
            n_windows += poses.dim(0)?;
        }
        let split = self.split.name().to_owned();
        Ok(Validation { split, n_windows, generator: made.figures(), mean_pose: still.figures() })
    }
}

/// A predictor's errors so far.
#[derive(Default)]
struct Tally {
    error: f64,
    n_numbers: f64,
    correct: Correct,
}

impl Tally {
    fn add(&mut self, made: &Tensor, batch: &Batch, normal: &Normalisation) -> Result<()> {
        let seen = f64::from(batch.mask.sum_all()?.to_scalar::<f32>()?);
        self.error += f64::from(losses::l1(made, &batch.poses, &batch.mask)?.to_scalar::<f32>()?) * seen;
        self.n_numbers += seen;
        for i in 0..made.dim(0)? {
            let window = |x: &Tensor| -> Result<Array2<f32>> {
                let values = x.get(i)?.flatten_all()?.to_vec1::<f32>()?;
                Ok(Array2::from_shape_vec((N_NUMBERS, values.len() / N_NUMBERS), values)?)
            };
            let joints = |x: &Tensor| -> Result<_> { Ok(normal.joints(window(x)?.view())) };
            let mask = joints_seen(window(&batch.mask)?.view());
            self.correct.count(joints(made)?.view(), joints(&batch.poses)?.view(), mask.view());
        }
        Ok(())
    }

    fn figures(&self) -> Figures {
        Figures { l1: self.error / self.n_numbers.max(1.0), pck: self.correct.share() }
    }
}

/// Mask of numbers [144, T] to mask of joints [T, 49]; the hand roots are seen where the wrists are.
fn joints_seen(mask: ArrayView2<f32>) -> Array2<bool> {
    Array2::from_shape_fn((mask.ncols(), N_JOINTS), |(t, joint)| match joint {
        NECK => true,
        L_HAND => mask[[3 * (L_WRIST - 1), t]] > 0.0,
        R_HAND => mask[[3 * (R_WRIST - 1), t]] > 0.0,
        _ => mask[[3 * (joint - 1), t]] > 0.0,
    })
}
