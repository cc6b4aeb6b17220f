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
