//! What FineMotion's networks are trained to make small (GENEA 2020 entry, section on training; where paper and code
//! differ both are here, and the code's reading is the default). Pure functions of poses [B, T, X] and of logits.

use candle_core::{Result, Tensor};
use orator_dataset::config::{ContinuityLoss, DistanceLoss, ReachLoss};
use serde::{Deserialize, Serialize};

/// Added under a root, which has no slope at 0.
const TINY: f64 = 1e-12;

/// Mean absolute difference (code).
pub fn l1(made: &Tensor, real: &Tensor) -> Result<Tensor> {
    (made - real)?.abs()?.mean_all()
}

/// Mean squared difference (paper).
pub fn mse(made: &Tensor, real: &Tensor) -> Result<Tensor> {
    (made - real)?.sqr()?.mean_all()
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
    (softplus(&real.neg()?)?.mean_all()? + softplus(generated)?.mean_all()?)? * 0.5
}

/// Binary cross-entropy of generated logits against 1 (non-saturating).
pub fn adversarial(generated: &Tensor) -> Result<Tensor> {
    softplus(&generated.neg()?)?.mean_all()
}

/// Differences of following poses: [B, T, X] to [B, T - 1, X].
fn steps(poses: &Tensor) -> Result<Tensor> {
    let n = poses.dim(1)?.saturating_sub(1);
    poses.narrow(1, 1, n)? - poses.narrow(1, 0, n)?
}

/// log(1 + e^x), without overflow.
fn softplus(x: &Tensor) -> Result<Tensor> {
    x.relu()? + (x.abs()?.neg()?.exp()? + 1.0)?.log()?
}

/// The loss of a generator, by parts and weights.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SequenceLoss {
    pub distance: DistanceLoss,
    pub continuity: ContinuityLoss,
    pub reach: ReachLoss,
    pub continuity_weight: f64,
    pub reach_weight: f64,
    /// Of the adversarial loss, where there is a discriminator.
    pub adversarial_weight: f64,
}

impl Default for SequenceLoss {
    fn default() -> Self {
        Self {
            distance: DistanceLoss::default(),
            continuity: ContinuityLoss::default(),
            reach: ReachLoss::default(),
            continuity_weight: 0.01,
            reach_weight: 1.0,
            adversarial_weight: 0.01,
        }
    }
}

impl SequenceLoss {
    /// That of the adversarial network: squared differences, no reward of reach.
    pub fn of_adversarial(self) -> Self {
        Self { distance: DistanceLoss::Mse, reach_weight: 0.0, ..self }
    }

    /// The weighted sum for poses and, where there is a discriminator, its logits of them.
    pub fn total(&self, made: &Tensor, real: &Tensor, logits: Option<&Tensor>) -> Result<Tensor> {
        let mut total = match self.distance {
            DistanceLoss::L1 => l1(made, real)?,
            DistanceLoss::Mse => mse(made, real)?,
        };
        if self.continuity_weight != 0.0 {
            let part = match self.continuity {
                ContinuityLoss::Numbers => continuity_of_numbers(made)?,
                ContinuityLoss::Poses => continuity_of_poses(made)?,
            };
            total = (total + (part * self.continuity_weight)?)?;
        }
        if self.reach_weight != 0.0 {
            let part = match self.reach {
                ReachLoss::Excursion => excursion(made)?,
                ReachLoss::Variance => variance(made)?,
            };
            total = (total + (part * self.reach_weight)?)?;
        }
        match logits {
            Some(logits) => total + (adversarial(logits)? * self.adversarial_weight)?,
            None => Ok(total),
        }
    }
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
        assert!(near(adversarial(&logits(0.5, -90.0)?), (entropy(0.5) + 90.0) / 2.0)?);
        let of_code = SequenceLoss::default().total(&made, &real, None);
        assert!(near(of_code, 0.75 + 0.01 * 1.75 - 1.75)?);
        let of_gan = SequenceLoss::default().of_adversarial().total(&made, &real, Some(&logits(0.0, 0.0)?));
        assert!(near(of_gan, 1.25 + 0.0175 + 0.01 * 2f64.ln())?);
        Ok(())
    }

    #[test]
    fn gradients_are_right() -> Result<()> {
        let (made, real) = (pattern(&[2, 4, 3], 0.0)?, pattern(&[2, 4, 3], 3.0)?);
        let of_paper = SequenceLoss {
            distance: DistanceLoss::Mse,
            continuity: ContinuityLoss::Poses,
            reach: ReachLoss::Variance,
            ..SequenceLoss::default()
        };
        for loss in [SequenceLoss::default(), of_paper] {
            assert!(worst(&[made.clone(), real.clone()], |v| loss.total(&v[0], &v[1], Some(&v[0])))? < 1e-7);
        }
        assert!(worst(&[made, real], |v| discriminator(&v[0], &v[1]))? < 1e-7);
        // Poses that stay where they are have no slope, and no NaN.
        let still = Tensor::zeros((1, 3, 2), candle_core::DType::F64, &Device::Cpu)?;
        assert!(worst(std::slice::from_ref(&still), |v| excursion(&v[0])? + continuity_of_poses(&v[0])?)?.is_finite());
        Ok(())
    }
}
