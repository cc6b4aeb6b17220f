//! A step on a GPU: the losses of `gan::losses` in the kernels of `nn::gpu`, the discriminator on real and generated
//! motion at once, and no value is read.

use super::super::{average, losses};
use super::batch::StepBatch;
use super::loss_log::StepValue;
use super::trainer::GanTrainer;
use crate::generate::normalisation::N_FEATURES;
use anyhow::Result;
use candle_core::Tensor;
use orator_dataset::config::AdversarialLoss;
use orator_nn::gpu::poses::{ScoreTerm, motion, pose_losses, score_losses};

/// Terms of the scores of real and generated motion in the discriminator's loss, and of the latter in the generator's.
fn terms(loss: AdversarialLoss) -> [ScoreTerm; 3] {
    match loss {
        AdversarialLoss::Auto | AdversarialLoss::LeastSquares => {
            [ScoreTerm::DistanceTo1, ScoreTerm::DistanceTo0, ScoreTerm::DistanceTo1]
        }
        AdversarialLoss::Log => [ScoreTerm::Rejected, ScoreTerm::Accepted, ScoreTerm::Rejected],
        AdversarialLoss::Minimax => [ScoreTerm::Rejected, ScoreTerm::Accepted, ScoreTerm::MinusAccepted],
    }
}

impl GanTrainer {
    /// Runs one step of the discriminator, then one of the generator, on the same windows.
    pub(super) fn advance_on_device(&mut self, batch: &StepBatch) -> Result<()> {
        let settings = &self.settings;
        let (lambda_gan, learning_rate) = (settings.adversarial_weight(self.step), settings.rate(self.step));
        let [of_real, of_generated, of_generator] = terms(settings.adversarial);
        let StepBatch { windows, noise, .. } = batch;
        let (truth, mask) = (&windows.poses, &windows.mask);
        let generated = self.speakers.poses(&self.predict(batch)?, &windows.speakers)?;
        let values = self.losses.on_device(self.step + 1, settings, truth.device())?;
        if lambda_gan > 0.0 {
            let motion = motion(Some(truth), &generated.detach(), mask, noise.as_ref())?;
            let scores = self.discriminator.scores_of_groups(&motion, true, 2)?;
            let slot = values.part(StepValue::Discriminator, 1)?;
            let loss = score_losses(&scores, scores.elem_count() / 2, [of_real, of_generated], 1.0, &slot)?;
            self.adam_d.minimise(&loss, learning_rate, &values.part(StepValue::DiscriminatorNorm, 1)?)?;
        }
        let weights = [settings.lambda_l1, settings.lambda_speed, settings.lambda_energy];
        let poses = [&generated, truth, mask];
        let mut total = pose_losses(poses, N_FEATURES / 3, weights, &values.part(StepValue::L1, 3)?)?;
        let mut add = |loss: Tensor, weight: f64, value: StepValue| -> Result<()> {
            values.set(value, &loss)?;
            total = (&total + (loss * weight)?)?;
            Ok(())
        };
        if settings.lambda_velocity > 0.0 {
            add(losses::velocity(&generated, truth, mask)?, settings.lambda_velocity, StepValue::Velocity)?;
        }
        if settings.lambda_bone > 0.0
            && let Some(loss) = self.speakers.bone_loss(&generated, &windows.speakers)?
        {
            add(loss, settings.lambda_bone, StepValue::Bone)?;
        }
        if lambda_gan > 0.0 {
            let n_windows = truth.dim(0)?;
            let noise = noise.as_ref().map(|noise| noise.narrow(0, n_windows, n_windows)).transpose()?;
            let scores = self.discriminator.forward(&motion(None, &generated, mask, noise.as_ref())?, true)?;
            let (n, slot) = (scores.elem_count(), values.part(StepValue::Adversarial, 1)?);
            total = (total + score_losses(&scores, n, [of_generator; 2], lambda_gan, &slot)?)?;
        }
        self.adam_g.minimise(&total, learning_rate, &values.part(StepValue::GradientNorm, 1)?)?;
        if let Some((_, ema)) = &self.ema {
            let decay = self.settings.ema_decay;
            average::update(ema, &self.generator_params, self.ema_parts.as_ref(), decay, self.step)?;
        }
        self.step += 1;
        Ok(())
    }
}
