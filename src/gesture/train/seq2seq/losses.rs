//! What FineMotion's networks are trained to make small (GENEA 2020 entry, section on training; where paper and code
//! differ both are here, and the code's reading is the default). Pure functions of poses [B, T, X] and of logits.

use crate::train::gan::losses::{discriminator_loss, generator_loss};
use candle_core::{Result, Tensor};
use candle_nn::loss::mse;
use orator_dataset::config::{AdversarialLoss, ContinuityLoss, DistanceLoss, ReachLoss, Seq2seqConfig};

/// Added under a root, which has no slope at 0.
const TINY: f64 = 1e-12;

/// Mean absolute difference (code).
pub fn l1(made: &Tensor, real: &Tensor) -> Result<Tensor> {
    (made - real)?.abs()?.mean_all()
}

/// Sum of absolute differences of following poses over the number of all numbers (code).
pub fn continuity_of_numbers(made: &Tensor) -> Result<Tensor> {
    steps(made)?.abs()?.sum_all()? / made.elem_count() as f64
}

/// Mean Euclidean length of the differences of following poses (paper).
pub fn continuity_of_poses(made: &Tensor) -> Result<Tensor> {
    (steps(made)?.sqr()?.sum(2)? + TINY)?.sqrt()?.mean_all()
}

/// Less than nothing: minus the sum over samples and numbers of the Euclidean norm over time, over the number of all
/// numbers (code). No mean is subtracted, so that it rewards distance from the pose of zeros.
pub fn excursion(made: &Tensor) -> Result<Tensor> {
    (made.sqr()?.sum(1)? + TINY)?.sqrt()?.sum_all()? / -(made.elem_count() as f64)
}

/// Less than nothing: minus the mean over samples and numbers of the variance over time (paper).
pub fn variance(made: &Tensor) -> Result<Tensor> {
    made.broadcast_sub(&made.mean_keepdim(1)?)?.sqr()?.mean_all()?.neg()
}

/// Half the sum of the binary cross-entropies of real logits against 1 and of generated ones against 0.
pub fn discriminator(generated: &Tensor, real: &Tensor) -> Result<Tensor> {
    discriminator_loss(AdversarialLoss::Log, real, generated)? * 0.5
}

/// Differences of following poses: [B, T, X] to [B, T - 1, X].
fn steps(poses: &Tensor) -> Result<Tensor> {
    let n = poses.dim(1)?.saturating_sub(1);
    poses.narrow(1, 1, n)? - poses.narrow(1, 0, n)?
}

/// Settings of the adversarial network's loss: squared differences, no reward of reach.
pub fn of_adversarial(settings: &Seq2seqConfig) -> Seq2seqConfig {
    Seq2seqConfig { distance: DistanceLoss::Mse, lambda_reach: 0.0, ..settings.clone() }
}

/// The weighted sum for poses and, where there is a discriminator, its logits of them.
pub fn total(settings: &Seq2seqConfig, made: &Tensor, real: &Tensor, logits: Option<&Tensor>) -> Result<Tensor> {
    let mut total = match settings.distance {
        DistanceLoss::L1 => l1(made, real)?,
        DistanceLoss::Mse => mse(made, real)?,
    };
    let mut add = |part: Tensor, weight: f64| -> Result<()> {
        total = (&total + (part * weight)?)?;
        Ok(())
    };
    if settings.lambda_continuity != 0.0 {
        let part = match settings.continuity {
            ContinuityLoss::Numbers => continuity_of_numbers(made)?,
            ContinuityLoss::Poses => continuity_of_poses(made)?,
        };
        add(part, settings.lambda_continuity)?;
    }
    if settings.lambda_reach != 0.0 {
        let part = match settings.reach {
            ReachLoss::Excursion => excursion(made)?,
            ReachLoss::Variance => variance(made)?,
        };
        add(part, settings.lambda_reach)?;
    }
    if let Some(logits) = logits {
        add(generator_loss(AdversarialLoss::Log, logits)?, settings.lambda_adversarial)?;
    }
    Ok(total)
}

#[cfg(test)]
mod tests {
    use super::*;
    use candle_core::Device;
    use orator_nn::ops::gradcheck::{pattern, worst};

    fn number(loss: Result<Tensor>) -> Result<f64> {
        loss?.to_scalar()
    }

    #[test]
    fn losses_are_what_their_formulas_say() -> Result<()> {
        // Two poses of two numbers: from (3, 0) to (0, 4).
        let made = Tensor::new(&[[[3.0, 0.0], [0.0, 4.0]]], &Device::Cpu)?;
        let real = Tensor::new(&[[[1.0, 0.0], [0.0, 5.0]]], &Device::Cpu)?;
        let near =
            |loss: Result<Tensor>, expected: f64| -> Result<bool> { Ok((number(loss)? - expected).abs() < 1e-9) };
        assert!(near(l1(&made, &real), 0.75)? && near(mse(&made, &real), 1.25)?);
        assert!(near(continuity_of_numbers(&made), 7.0 / 4.0)? && near(continuity_of_poses(&made), 5.0)?);
        // Norms over time 3 and 4; variances 2.25 and 4.
        assert!(near(excursion(&made), -7.0 / 4.0)? && near(variance(&made), -3.125)?);
        let logits = |a: f64, b: f64| Tensor::new(&[[a], [b]], &Device::Cpu);
        let entropy = |x: f64| -(1.0 / (1.0 + (-x).exp())).ln();
        let expected = (entropy(2.0) + entropy(-1.0) + entropy(-0.5) + entropy(1.0)) / 4.0;
        assert!(near(discriminator(&logits(0.5, -1.0)?, &logits(2.0, -1.0)?), expected)?);
        assert!(near(generator_loss(AdversarialLoss::Log, &logits(0.5, -90.0)?), (entropy(0.5) + 90.0) / 2.0)?);
        let settings = Seq2seqConfig::default();
        let of_code = total(&settings, &made, &real, None);
        assert!(near(of_code, 0.75 + 0.01 * 1.75 - 1.75)?);
        let of_gan = total(&of_adversarial(&settings), &made, &real, Some(&logits(0.0, 0.0)?));
        assert!(near(of_gan, 1.25 + 0.0175 + 0.01 * 2f64.ln())?);
        Ok(())
    }

    #[test]
    fn gradients_are_right() -> Result<()> {
        let (made, real) = (pattern(&[2, 4, 3], 0.0)?, pattern(&[2, 4, 3], 3.0)?);
        let of_paper = Seq2seqConfig {
            distance: DistanceLoss::Mse,
            continuity: ContinuityLoss::Poses,
            reach: ReachLoss::Variance,
            ..Seq2seqConfig::default()
        };
        for settings in [Seq2seqConfig::default(), of_paper] {
            assert!(worst(&[made.clone(), real.clone()], |v| total(&settings, &v[0], &v[1], Some(&v[0])))? < 1e-7);
        }
        assert!(worst(&[made, real], |v| discriminator(&v[0], &v[1]))? < 1e-7);
        // Poses that stay where they are have no slope, and no NaN.
        let still = Tensor::zeros((1, 3, 2), candle_core::DType::F64, &Device::Cpu)?;
        assert!(worst(std::slice::from_ref(&still), |v| excursion(&v[0])? + continuity_of_poses(&v[0])?)?.is_finite());
        Ok(())
    }
}
