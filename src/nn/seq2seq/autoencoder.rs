//! Network D, the audio baseline: a denoising autoencoder of single poses, and an encoder from speech to its codes
//! (Kucherenko et al. 2019, with the context encoder of network B).

use super::config::{Config, Segment};
use super::encoders::ContextEncoder;
use super::predict::GesturePredictor;
use crate::Mode;
use crate::ops::affine::Affine;
use crate::ops::dropout::dropout;
use crate::params::Params;
use candle_core::{Module, Result, Tensor, Var};

/// Autoencoder of a pose with ReLU after the hidden layers and tanh after code and output. Tensors under `<name>`:
/// `encoder.0`, `encoder.2`, `decoder.0`, `decoder.2`.
pub struct PoseAutoencoder {
    layers: [Affine; 4],
}

impl PoseAutoencoder {
    pub fn new(params: &mut Params, name: &str, config: &Config) -> Result<Self> {
        let Config { pose, pose_hidden, code, .. } = *config;
        let mut layer = |own: &str, n: [usize; 2]| Affine::new(params, &format!("{name}{own}"), n[0], n[1]);
        Ok(Self {
            layers: [
                layer("encoder.0", [pose, pose_hidden])?.with_relu(),
                layer("encoder.2", [pose_hidden, code])?,
                layer("decoder.0", [code, pose_hidden])?.with_relu(),
                layer("decoder.2", [pose_hidden, pose])?,
            ],
        })
    }

    /// Encodes poses [B, pose] to codes [B, code].
    pub fn encode(&self, poses: &Tensor) -> Result<Tensor> {
        self.layers[1].forward(&self.layers[0].forward(poses)?)?.tanh()
    }

    /// Decodes codes [B, code] to poses [B, pose].
    pub fn decode(&self, codes: &Tensor) -> Result<Tensor> {
        self.layers[3].forward(&self.layers[2].forward(codes)?)?.tanh()
    }

    /// Reconstructs poses, to which the caller has added noise.
    pub fn forward(&self, poses: &Tensor) -> Result<Tensor> {
        self.decode(&self.encode(poses)?)
    }
}

/// Encoder from audio to codes. Tensors under `<name>`: `audio_encoder` as in network B, and, after dropout, `linear`.
pub struct SpeechEncoder {
    audio: ContextEncoder,
    linear: Affine,
    config: Config,
}

impl SpeechEncoder {
    pub fn new(params: &mut Params, name: &str, config: &Config) -> Result<Self> {
        Ok(Self {
            audio: ContextEncoder::new(params, &format!("{name}audio_encoder"), config)?,
            linear: Affine::new(params, &format!("{name}linear"), config.hidden, config.code)?,
            config: config.clone(),
        })
    }

    /// Encodes audio [B, T + context - 1, audio] to codes [B, T, code].
    pub fn forward(&self, audio: &Tensor, mode: &mut Mode) -> Result<Tensor> {
        let features = dropout(&self.audio.forward(audio, mode)?, self.config.dropout, mode)?;
        self.linear.forward(&features)?.reshape((audio.dim(0)?, (), self.config.code))
    }
}

/// Network D: speech to codes to poses. Tensors: `autoencoder.`, `speech.`, and two that are set before the training:
/// `scale` [pose], by which poses are divided so that they lie in the range of tanh, and `noise` [pose], the standard
/// deviation of the noise that is added to the scaled poses.
pub struct AudioBaseline {
    autoencoder: PoseAutoencoder,
    speech: SpeechEncoder,
    scale: Var,
    noise: Var,
    config: Config,
}

impl AudioBaseline {
    /// Creates a network with scales of 1 and without noise.
    pub fn new(params: &mut Params, config: &Config) -> Result<Self> {
        Ok(Self {
            autoencoder: PoseAutoencoder::new(params, "autoencoder.", config)?,
            speech: SpeechEncoder::new(params, "speech.", config)?,
            scale: params.buffer("scale", &[config.pose], 1.0)?,
            noise: params.buffer("noise", &[config.pose], 0.0)?,
            config: config.clone(),
        })
    }

    /// Sets the scales (above 0) and the standard deviations of the noise.
    pub fn set_scale(&self, scale: &Tensor, noise: &Tensor) -> Result<()> {
        self.scale.set(scale)?;
        self.noise.set(noise)
    }

    /// Mean squared error of the reconstruction of scaled poses [B, T, pose], to which `normal` [B, T, pose] of unit
    /// variance times the noise is added.
    pub fn pose_loss(&self, poses: &Tensor, normal: &Tensor) -> Result<Tensor> {
        let poses = poses.broadcast_div(self.scale.as_tensor())?.flatten_to(1)?;
        let noise = normal.broadcast_mul(self.noise.as_tensor())?.flatten_to(1)?;
        (self.autoencoder.forward(&(&poses + noise)?)? - poses)?.sqr()?.mean_all()
    }

    /// Mean squared error between codes from the audio and those of real poses [B, predicted, pose], without gradient.
    pub fn speech_loss(&self, audio: &Tensor, poses: &Tensor, mode: &mut Mode) -> Result<Tensor> {
        let poses = poses.broadcast_div(self.scale.as_tensor())?;
        let codes = self.autoencoder.encode(&poses.flatten_to(1)?)?.detach();
        let predicted = self.speech.forward(audio, mode)?;
        (predicted.flatten_to(1)? - codes)?.sqr()?.mean_all()
    }
}

impl GesturePredictor for AudioBaseline {
    fn config(&self) -> &Config {
        &self.config
    }

    fn audio_baseline(&self) -> Option<&AudioBaseline> {
        Some(self)
    }

    fn forward(&self, segment: &Segment, mode: &mut Mode) -> Result<Tensor> {
        self.config.check(segment)?;
        let codes = self.speech.forward(&segment.audio, mode)?;
        let poses = self.autoencoder.decode(&codes.flatten_to(1)?)?.broadcast_mul(self.scale.as_tensor())?;
        poses.reshape((codes.dim(0)?, self.config.predicted, self.config.pose))
    }
}
