//! `[gan]` of `pipeline.toml`: the training of the speech-to-gesture network, as it is asked for. What is `"auto"` the
//! recipe chooses (`train::gan::recipe`).

use super::auto::Auto;
use super::choices::{AdversarialLoss, ComputeDevice, GanRecipe, MotionRepresentation, NetworkPreset};
use orator_base::types::posture::PostureChannel;
use serde::{Deserialize, Serialize};

/// `[gan]`: the generator's training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GanConfig {
    /// What chooses the values that are `"auto"`.
    pub recipe: GanRecipe,
    pub preset: NetworkPreset,
    pub representation: MotionRepresentation,
    /// What is learnt beside the 49 joints.
    pub channels: Vec<PostureChannel>,
    /// Window length in frames.
    pub window_frames: usize,
    /// Frames between the starts of two windows of an interval.
    pub stride_frames: usize,
    pub batch: Auto<usize>,
    pub steps: Auto<usize>,
    /// Highest learning rate.
    pub learning_rate: Auto<f64>,
    /// Of a new speaker in a model of several: share of the learning rate at which the weights move that all speakers have in
    /// common; 0: only its own layer is learnt.
    pub shared_rate: Auto<f64>,
    /// Steps in which the learning rate rises from 0.
    pub warmup_steps: Auto<usize>,
    /// Share of the learning rate that is left at the last step, along half a cosine; 1: it stays.
    pub fade_to: Auto<f64>,
    pub adversarial: AdversarialLoss,
    /// Weights of the losses.
    pub lambda_l1: f64,
    pub lambda_velocity: f64,
    /// Of the squared error of the joints' speeds: when they move, wherever they go.
    pub lambda_speed: Auto<f64>,
    /// Of the distance of the joints' mean squared speeds from the data's.
    pub lambda_energy: Auto<f64>,
    pub lambda_gan: Auto<f64>,
    pub lambda_bone: f64,
    /// Step from which there is an adversarial loss, and steps in which its weight then rises from 0.
    pub adversarial_from: Auto<usize>,
    pub adversarial_ramp: Auto<usize>,
    /// Weight of the past in the mean of the generator's weights that is validated and generates; 0: no mean.
    pub ema_decay: Auto<f64>,
    /// Share of the channels of the encoded sound that a step drops.
    pub dropout: Auto<f64>,
    /// Weight decay beside Adam (Loshchilov & Hutter 2019).
    pub weight_decay: Auto<f64>,
    /// Largest change of a window's speed, sound and motion alike, as a share.
    pub augment_speed: Auto<f64>,
    /// Largest shift of the spectrogram along its bands.
    pub augment_pitch: Auto<f64>,
    /// Largest change of loudness, dB.
    pub augment_gain_db: Auto<f64>,
    /// Loudest noise added, dB against the window's mean; -120: none.
    pub augment_noise_db: Auto<f64>,
    /// Most bands, and most seconds, that one mask hides.
    pub augment_mask_bands: Auto<usize>,
    pub augment_mask_secs: Auto<f64>,
    /// Deviation of noise on the poses that the discriminator sees, normalised.
    pub augment_pose_noise: Auto<f64>,
    /// Share of the windows whose body is mirrored.
    pub augment_mirror: f64,
    pub seed: u64,
    /// Steps of an epoch: at its end comes a validation.
    pub epoch_steps: Auto<usize>,
    /// Epochs without a better score after which the training ends; 0: never.
    pub patience: Auto<usize>,
    /// Steps between checkpoints; one comes with each validation too.
    pub checkpoint_every: usize,
    /// Checkpoints kept.
    pub keep_checkpoints: usize,
    pub device: ComputeDevice,
}

impl Default for GanConfig {
    fn default() -> Self {
        let number = Auto::<f64>::Chosen;
        let count = Auto::<usize>::Chosen;
        Self {
            recipe: GanRecipe::Auto,
            preset: NetworkPreset::Light,
            representation: MotionRepresentation::Bones,
            channels: Vec::new(),
            window_frames: 64,
            stride_frames: 5,
            batch: count,
            steps: count,
            learning_rate: number,
            shared_rate: number,
            warmup_steps: count,
            fade_to: number,
            adversarial: AdversarialLoss::LeastSquares,
            lambda_l1: 1.0,
            lambda_speed: number,
            lambda_energy: number,
            lambda_velocity: 0.0,
            lambda_gan: number,
            lambda_bone: 0.1,
            adversarial_from: count,
            adversarial_ramp: count,
            ema_decay: number,
            dropout: number,
            weight_decay: number,
            augment_speed: number,
            augment_pitch: number,
            augment_gain_db: number,
            augment_noise_db: number,
            augment_mask_bands: count,
            augment_mask_secs: number,
            augment_pose_noise: number,
            augment_mirror: 0.0,
            seed: 1337,
            epoch_steps: count,
            patience: count,
            checkpoint_every: 100,
            keep_checkpoints: 3,
            device: ComputeDevice::Cpu,
        }
    }
}
