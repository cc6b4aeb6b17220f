//! Windows of a step with its random numbers, which depend only on the seed and the step: dropped words, dropout, noise.
//! The threads that prefetch the windows draw them, so that the step does not wait.

use super::super::windows::WindowBatch;
use super::super::{augment, words};
use crate::train::resume;
use anyhow::Result;
use candle_core::{Device, Tensor};
use orator_dataset::config::GanSettings;
use orator_nn::gan::generator::Config;
use rand::Rng;

/// Seed modifier that makes dropout independent of the other random numbers of a step.
const DROPOUT: u64 = 0x6472_6f70;
const WORD_DROPOUT: u64 = 0x776f_7264;

pub struct StepBatch {
    /// Windows with the words that are not dropped.
    pub windows: WindowBatch,
    /// Factors of the channels of the encoded audio and words, [B, 1, channels].
    pub dropout: Option<Tensor>,
    /// Noise of the discriminator's input, [2B, features, T - 1], first of real motion, then of generated motion. Noise
    /// keeps the discriminator from memorising the windows (Arjovsky & Bottou 2017).
    pub noise: Option<Tensor>,
}

impl StepBatch {
    /// Draws the random numbers of the step after `step` completed steps, and sends all to `device`.
    pub fn draw(
        windows: &WindowBatch,
        settings: &GanSettings,
        network: &Config,
        step: usize,
        device: &Device,
    ) -> Result<Self> {
        let (n_windows, n_features, n_frames) = windows.poses.dims3()?;
        let rng = &mut resume::step_rng(settings.seed ^ WORD_DROPOUT, step);
        let dropped = windows.words.as_ref().map(|words| words::dropped(words, network.vocabulary, rng)).transpose()?;
        let n_channels = if network.vocabulary > 0 { 2 * network.width } else { network.width };
        let mut rng = resume::step_rng(settings.seed ^ DROPOUT, step);
        let dropout = settings.dropout;
        let factor = |_| if rng.random_bool(dropout) { 0.0 } else { 1.0 / (1.0 - dropout) as f32 };
        let factors = (dropout > 0.0).then(|| (0..n_windows * n_channels).map(factor).collect::<Vec<f32>>());
        let (std, n) = (settings.augment_pose_noise, n_windows * n_features * n_frames.saturating_sub(1));
        let has_noise = std > 0.0 && settings.adversarial_weight(step) > 0.0;
        let noise = has_noise.then(|| {
            let [real, generated] = [1, 0].map(|which| augment::gaussian(n, std, settings.seed ^ which, step));
            [real, generated].concat()
        });
        let tensor = |values: Vec<f32>, shape: [usize; 3]| Tensor::from_vec(values, &shape, device);
        Ok(Self {
            windows: WindowBatch { words: dropped, ..windows.on(&Device::Cpu)? }.on(device)?,
            dropout: factors.map(|factors| tensor(factors, [n_windows, 1, n_channels])).transpose()?,
            noise: noise.map(|noise| tensor(noise, [2 * n_windows, n_features, n_frames - 1])).transpose()?,
        })
    }
}
