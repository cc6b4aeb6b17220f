//! Training losses of FineMotion's networks (GENEA 2020 entry, sections 4.1 and 4.3), as pure functions of poses [B, T,
//! X] and of logits. Where paper and published code differ, both are implemented, the code's is the default.

use crate::train::gan::losses::{discriminator_loss, generator_loss};
use candle_core::{Result, Tensor};
use candle_nn::loss::mse;
use orator_dataset::config::{AdversarialLoss, ContinuityLoss, DistanceLoss, Seq2seqSettings, VarianceLoss};

/// Added under a square root, whose derivative is infinite at 0.
const TINY: f64 = 1e-12;

/// Mean absolute error (published code).
pub fn l1(generated: &Tensor, real: &Tensor) -> Result<Tensor> {
    (generated - real)?.abs()?.mean_all()
}

/// Sum of the absolute differences of consecutive poses, divided by the size of `generated` (published code).
pub fn continuity_of_numbers(generated: &Tensor) -> Result<Tensor> {
    steps(generated)?.abs()?.sum_all()? / generated.elem_count() as f64
}

/// Mean Euclidean norm of the differences of consecutive poses (paper).
pub fn continuity_of_poses(generated: &Tensor) -> Result<Tensor> {
    (steps(generated)?.sqr()?.sum(2)? + TINY)?.sqrt()?.mean_all()
}

/// Variance reward as in the published code, negative: minus the sum over samples and features of the Euclidean norm
/// over time, divided by the number of elements. No mean is subtracted, so it rewards distance from the all-zero pose.
pub fn variance_loss_of_code(generated: &Tensor) -> Result<Tensor> {
    (generated.sqr()?.sum(1)? + TINY)?.sqrt()?.sum_all()? / -(generated.elem_count() as f64)
}

/// Variance reward as in the paper, never positive: minus the mean over samples and features of the variance over time.
pub fn variance_loss_of_paper(generated: &Tensor) -> Result<Tensor> {
    generated.broadcast_sub(&generated.mean_keepdim(1)?)?.sqr()?.mean_all()?.neg()
}

/// Discriminator loss: half the sum of binary cross-entropies of real logits (target 1) and generated ones (target 0).
pub fn discriminator(generated: &Tensor, real: &Tensor) -> Result<Tensor> {
    discriminator_loss(AdversarialLoss::Log, real, generated)? * 0.5
}

/// Differences of consecutive poses: [B, T, X] to [B, T - 1, X].
fn steps(poses: &Tensor) -> Result<Tensor> {
    let n = poses.dim(1)?.saturating_sub(1);
    poses.narrow(1, 1, n)? - poses.narrow(1, 0, n)?
}

/// Loss settings of the adversarial network: mean squared error, no variance reward.
pub fn adversarial_settings(settings: &Seq2seqSettings) -> Seq2seqSettings {
    Seq2seqSettings { distance: DistanceLoss::Mse, lambda_variance: 0.0, ..settings.clone() }
}

/// Weighted sum of all losses; `logits` are the discriminator's for the generated poses, if there is a discriminator.
pub fn total(settings: &Seq2seqSettings, generated: &Tensor, real: &Tensor, logits: Option<&Tensor>) -> Result<Tensor> {
    let mut total = match settings.distance {
        DistanceLoss::Auto | DistanceLoss::L1 => l1(generated, real)?,
        DistanceLoss::Mse => mse(generated, real)?,
    };
    let mut add = |part: Tensor, weight: f64| -> Result<()> {
        total = (&total + (part * weight)?)?;
        Ok(())
    };
    if settings.lambda_continuity != 0.0 {
        let part = match settings.continuity {
            ContinuityLoss::Auto | ContinuityLoss::Numbers => continuity_of_numbers(generated)?,
            ContinuityLoss::Poses => continuity_of_poses(generated)?,
        };
        add(part, settings.lambda_continuity)?;
    }
    if settings.lambda_variance != 0.0 {
        let part = match settings.variance_loss {
            VarianceLoss::Auto | VarianceLoss::Norm => variance_loss_of_code(generated)?,
            VarianceLoss::Variance => variance_loss_of_paper(generated)?,
        };
        add(part, settings.lambda_variance)?;
    }
    if let Some(logits) = logits {
        add(generator_loss(AdversarialLoss::Log, logits)?, settings.lambda_adversarial)?;
    }
    Ok(total)
}
