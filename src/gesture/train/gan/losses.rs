//! Loss functions of the GAN, as pure functions of tensors.

use crate::generate::normalisation::{N_FEATURES, Normalisation};
use candle_core::{DType, Device, Result, Tensor};
use orator_base::types::skeleton::{L_HAND, L_WRIST, N_JOINTS, NECK, R_HAND, R_WRIST, is_duplicate, parent};
use orator_dataset::config::{AdversarialLoss, BoneLoss};
use orator_nn::gan::discriminator::motion;

pub fn number(scalar: &Tensor) -> anyhow::Result<f64> {
    Ok(f64::from(scalar.to_scalar::<f32>()?))
}

/// Mean absolute error over the elements whose mask is 1; all tensors have the same shape.
pub fn l1(generated: &Tensor, real: &Tensor, mask: &Tensor) -> Result<Tensor> {
    let n = mask.sum_all()?.maximum(1.0)?;
    ((generated - real)?.abs()? * mask)?.sum_all()? / n
}

/// Mean absolute error of the frame-to-frame differences, over the elements whose mask is 1 in both frames; all tensors
/// are [B, C, T].
pub fn velocity(generated: &Tensor, real: &Tensor, mask: &Tensor) -> Result<Tensor> {
    l1(&motion(generated)?, &motion(real)?, &both_visible(mask)?)
}

/// Mean squared error of the joint speeds, divided by the mean squared real speed; independent of the direction of
/// motion. All tensors are [B, C, T] with the three coordinates of each joint in the first 144 rows; a joint counts
/// where the mask of all its coordinates is 1 in both frames.
pub fn speed(generated: &Tensor, real: &Tensor, mask: &Tensor) -> Result<Tensor> {
    let mask = per_joint(&both_visible(mask)?)?.min(2)?;
    // The derivative of the root is infinite at 0. The offset is a speed of 0.001 standard deviations per frame.
    let speeds = |poses: &Tensor| (per_joint(&motion(poses)?)?.sqr()?.sum(2)? + 1e-6)?.sqrt();
    let real = speeds(real)?;
    let scale = (real.sqr()? * &mask)?.sum_all()?.maximum(1e-6)?;
    ((speeds(generated)? - real)?.sqr()? * mask)?.sum_all()? / scale
}

/// Difference of the log motion energies, |ln(generated / real)| of the mean squared speed of each joint, averaged over
/// the joints. L1 losses alone give motion that is too slow, since the exact time of a gesture is uncertain. The energy
/// is a statistic over all windows and frames in which a joint is visible (feature matching, Salimans et al. 2016).
/// Tensors as in [`speed`].
pub fn energy(generated: &Tensor, real: &Tensor, mask: &Tensor) -> Result<Tensor> {
    let mask = per_joint(&both_visible(mask)?)?.min(2)?;
    // The offset is a speed of 0.001 standard deviations per frame.
    let energies = |poses: &Tensor| {
        let squares = (per_joint(&motion(poses)?)?.sqr()?.sum(2)? * &mask)?;
        (squares.sum(2)?.sum(0)? / mask.sum(2)?.sum(0)?.maximum(1.0)?)? + 1e-6
    };
    (energies(generated)?.log()? - energies(real)?.log()?)?.abs()?.mean_all()
}

/// [B, C, T] to [B, joints, 3, T], without the posture channels that follow the joints.
fn per_joint(rows: &Tensor) -> Result<Tensor> {
    let (batch, _, n_frames) = rows.dims3()?;
    rows.narrow(1, 0, N_FEATURES)?.reshape((batch, N_FEATURES / 3, 3, n_frames))
}

/// Mask that is 1 where `mask` is 1 in a frame and in the previous one: [B, C, T] to [B, C, T - 1].
pub fn both_visible(mask: &Tensor) -> Result<Tensor> {
    let n = mask.dim(2)?.saturating_sub(1);
    mask.narrow(2, 1, n)? * mask.narrow(2, 0, n)?
}

/// Scalar loss of the discriminator for its scores (of any shape) of real and of generated motion.
pub fn discriminator_loss(loss: AdversarialLoss, real_scores: &Tensor, generated_scores: &Tensor) -> Result<Tensor> {
    match loss {
        AdversarialLoss::Auto | AdversarialLoss::LeastSquares => {
            (real_scores - 1.0)?.sqr()?.mean_all()? + generated_scores.sqr()?.mean_all()?
        }
        AdversarialLoss::Log | AdversarialLoss::Minimax => {
            softplus(&real_scores.neg()?)?.mean_all()? + softplus(generated_scores)?.mean_all()?
        }
    }
}

/// Scalar adversarial loss of the generator for the discriminator's scores (of any shape) of generated motion.
pub fn generator_loss(loss: AdversarialLoss, generated_scores: &Tensor) -> Result<Tensor> {
    match loss {
        AdversarialLoss::Auto | AdversarialLoss::LeastSquares => (generated_scores - 1.0)?.sqr()?.mean_all(),
        AdversarialLoss::Log => softplus(&generated_scores.neg()?)?.mean_all(),
        // log(1 - D) = -softplus(score).
        AdversarialLoss::Minimax => softplus(generated_scores)?.neg()?.mean_all(),
    }
}

/// log(1 + e^x) without overflow.
fn softplus(x: &Tensor) -> Result<Tensor> {
    x.relu()? + (x.abs()?.neg()?.exp()? + 1.0)?.log()?
}

/// Bone length constancy loss (Rebol et al. 2021, eq. 1): absolute change of the bone lengths between consecutive
/// frames, averaged over frames and batch; summed over the bones in metres, or averaged over the bones relative to the
/// speaker's length of each ([`BoneLoss`]). Holds the tables for the computation.
pub struct BoneConstancy {
    mean: Tensor,
    std: Tensor,
    /// Coordinate rows (including the neck's) of the joints at the far ends of the bones.
    children: Tensor,
    /// Coordinate rows of the joints at the near ends.
    parents: Tensor,
    /// Weight of each bone's change, [1, n_bones, 1]: 1, or 1 / length of the bone.
    weights: Tensor,
    /// Whether the changes are averaged over the bones instead of summed.
    is_mean: bool,
}

impl BoneConstancy {
    /// Loss over the bones of known length, without those to the hand roots, which coincide with the wrists.
    pub fn new(normal: &Normalisation, form: BoneLoss, dtype: DType, device: &Device) -> Result<Self> {
        let (mut children, mut parents, mut weights) = (Vec::new(), Vec::new(), Vec::new());
        for joint in 1..N_JOINTS {
            let length = f64::from(normal.bone_lengths.get(joint - 1).copied().unwrap_or(0.0));
            if is_duplicate(joint) || length < 1e-3 {
                continue;
            }
            let from = match parent(joint).unwrap_or(NECK) {
                L_HAND => L_WRIST,
                R_HAND => R_WRIST,
                other => other,
            };
            children.extend((0..3).map(|k| (3 * joint + k) as u32));
            parents.extend((0..3).map(|k| (3 * from + k) as u32));
            weights.push(if form == BoneLoss::Metres { 1.0 } else { 1.0 / length });
        }
        let column = |values: &[f32]| Tensor::new(values, device)?.to_dtype(dtype)?.reshape((1, (), 1));
        Ok(Self {
            mean: column(&normal.mean)?,
            std: column(&normal.std)?,
            children: Tensor::new(children, device)?,
            parents: Tensor::new(parents, device)?,
            is_mean: form != BoneLoss::Metres,
            weights: Tensor::new(weights, device)?.to_dtype(dtype)?.reshape((1, (), 1))?,
        })
    }

    /// Loss of normalised poses [B, 144 or more, T]; trailing channels (head, trunk) are ignored.
    pub fn loss(&self, poses: &Tensor) -> Result<Tensor> {
        let (batch, n_features, n_frames) = poses.dims3()?;
        let n_bones = self.weights.dim(1)?;
        if n_bones == 0 || n_frames < 2 || n_features < N_FEATURES {
            return poses.zeros_like()?.mean_all();
        }
        let poses = poses.narrow(1, 0, N_FEATURES)?;
        let metres = poses.broadcast_mul(&self.std)?.broadcast_add(&self.mean)?;
        let neck = Tensor::zeros((batch, 3, n_frames), poses.dtype(), poses.device())?;
        let joints = Tensor::cat(&[neck, metres], 1)?;
        let bones = (joints.index_select(&self.children, 1)? - joints.index_select(&self.parents, 1)?)?;
        let squares = bones.reshape((batch, n_bones, 3, n_frames))?.sqr()?.sum(2)?;
        // The derivative of the root is infinite at 0. The offset is a length of 0.1 mm.
        let lengths = (squares + 1e-8)?.sqrt()?.broadcast_mul(&self.weights)?;
        let change = (lengths.narrow(2, 1, n_frames - 1)? - lengths.narrow(2, 0, n_frames - 1)?)?;
        let mean = change.abs()?.mean_all()?;
        if self.is_mean { Ok(mean) } else { mean * n_bones as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;
    use orator_nn::ops::gradcheck::{pattern, worst};

    fn normal() -> Normalisation {
        let table = |value: f32| Array2::from_shape_fn((N_JOINTS, 3), |(j, k)| value + 0.01 * (j + 2 * k) as f32);
        Normalisation::new(&table(0.1), &table(0.3), vec![0.2; N_JOINTS - 1])
    }

    #[test]
    fn gradients_match_finite_differences() -> Result<()> {
        let shape = [2, 3, 4];
        let (generated, real) = (pattern(&shape, 0.0)?, pattern(&shape, 3.0)?);
        let mask = pattern(&shape, 9.0)?.gt(0.0)?.to_dtype(DType::F64)?;
        assert!(worst(std::slice::from_ref(&generated), |v| l1(&v[0], &real, &mask))? < 1e-7);
        assert!(worst(std::slice::from_ref(&generated), |v| velocity(&v[0], &real, &mask))? < 1e-7);
        let shape = [2, N_FEATURES + 2, 4];
        let (poses, real) = (pattern(&shape, 1.0)?, pattern(&shape, 5.0)?);
        let mask = pattern(&shape, 9.0)?.gt(-0.8)?.to_dtype(DType::F64)?;
        assert!(worst(std::slice::from_ref(&poses), |v| speed(&v[0], &real, &mask))? < 1e-6);
        assert!(worst(&[poses], |v| energy(&v[0], &real, &mask))? < 1e-6);
        Ok(())
    }

    #[test]
    fn masked_elements_are_ignored() -> Result<()> {
        let row = |values: [f64; 4]| Tensor::new(&values, &Device::Cpu);
        let (generated, real) = (row([1.0, 2.0, 3.0, 4.0])?, row([1.0, 4.0, 100.0, 5.0])?);
        let loss = |mask| -> Result<f64> { l1(&generated, &real, &row(mask)?)?.to_scalar() };
        assert_eq!(loss([1.0, 1.0, 0.0, 1.0])?, 1.0);
        assert_eq!(loss([0.0; 4])?, 0.0);
        Ok(())
    }

    #[test]
    fn the_velocity_loss_ignores_masked_differences() -> Result<()> {
        let row = |values: [f64; 3]| Tensor::new(&[[values]], &Device::Cpu);
        // Differences 1, -2 against 0, 3; the second is masked.
        let loss = velocity(&row([1.0, 2.0, 0.0])?, &row([1.0, 1.0, 4.0])?, &row([1.0, 1.0, 0.0])?)?;
        assert_eq!(loss.to_scalar::<f64>()?, 1.0);
        Ok(())
    }

    #[test]
    fn the_speed_loss_ignores_the_direction() -> Result<()> {
        // In `generated` one joint moves by (3, 4, 0); another is masked.
        let moved = |by: &[(usize, f64)]| -> Result<Tensor> {
            let mut numbers = vec![0.0; 2 * (N_FEATURES + 1)];
            by.iter().for_each(|(number, value)| numbers[2 * number + 1] = *value);
            Tensor::from_vec(numbers, (1, N_FEATURES + 1, 2), &Device::Cpu)
        };
        let generated = moved(&[(0, 3.0), (1, 4.0), (6, 9.0), (N_FEATURES, 9.0)])?;
        let seen = (moved(&[(7, -1.0)])? + 1.0)?;
        let of = |real: &[(usize, f64)]| -> Result<f64> { speed(&generated, &moved(real)?, &seen)?.to_scalar() };
        let close = |loss: f64, expected: f64| assert!((loss - expected).abs() < 5e-3, "{loss}, expected {expected}");
        close(of(&[(5, 2.0)])?, (25.0 + 4.0) / 4.0);
        close(of(&[(2, 5.0), (5, 2.0)])?, 4.0 / 29.0);
        close(of(&[(2, -5.0)])?, 0.0);
        Ok(())
    }

    #[test]
    fn energy_is_averaged_over_all_windows() -> Result<()> {
        let real = pattern(&[2, N_FEATURES, 5], 0.0)?;
        let of = |generated: &Tensor, mask: &Tensor| -> Result<f64> { energy(generated, &real, mask)?.to_scalar() };
        let all = real.ones_like()?;
        assert!(of(&real, &all)? < 1e-12);
        // Doubled speed is four times the energy; direction and offset do not matter.
        assert!((of(&(&real * 2.0)?, &all)? - 4.0f64.ln()).abs() < 1e-4);
        assert!(of(&(real.neg()? + 3.0)?, &all)? < 1e-9);
        // Swapped windows have the same energy; masked joints are ignored.
        let swapped = Tensor::cat(&[real.narrow(0, 1, 1)?, real.narrow(0, 0, 1)?], 0)?;
        assert!(of(&swapped, &all)? < 1e-9);
        let hidden = Tensor::cat(&[all.narrow(1, 0, 3)?.zeros_like()?, all.narrow(1, 3, N_FEATURES - 3)?], 1)?;
        let wild = Tensor::cat(&[(real.narrow(1, 0, 3)? * 9.0)?, real.narrow(1, 3, N_FEATURES - 3)?], 1)?;
        assert!(of(&wild, &hidden)? < 1e-12 && of(&wild, &all)? > 0.05);
        Ok(())
    }

    #[test]
    fn only_changing_bone_lengths_are_penalised() -> Result<()> {
        let bones = BoneConstancy::new(&normal(), BoneLoss::Relative, DType::F64, &Device::Cpu)?;
        let constant = pattern(&[1, N_FEATURES, 1], 0.0)?.broadcast_as((1, N_FEATURES, 5))?.contiguous()?;
        assert!(bones.loss(&constant)?.to_scalar::<f64>()? < 1e-12);
        let moving = pattern(&[1, N_FEATURES, 5], 0.0)?;
        let loss = bones.loss(&moving)?.to_scalar::<f64>()?;
        let with_channels = Tensor::cat(&[&moving, &pattern(&[1, 6, 5], 7.0)?], 1)?;
        assert!(loss > 0.01 && loss == bones.loss(&with_channels)?.to_scalar::<f64>()?);
        Ok(())
    }
}
