//! Network D, the audio baseline: a denoising autoencoder of single poses, and an encoder from speech to its code
//! (Kucherenko et al. 2019, with the context encoder of network B).

use super::config::Config;
use super::context::ContextEncoder;
use crate::nn::Mode;
use crate::nn::ops::affine::Affine;
use crate::nn::ops::dropout::dropout;
use crate::nn::params::Params;
use candle_core::{Module, Result, Tensor};

/// `encoder.0`, `encoder.2`, `decoder.0`, `decoder.2`: a pose to its code and back, ReLU within, tanh behind.
pub struct PoseAutoencoder {
    layers: [Affine; 4],
}

impl PoseAutoencoder {
    pub fn new(params: &mut Params, config: &Config) -> Result<Self> {
        let Config { pose, pose_hidden, code, .. } = *config;
        let mut layer = |name: &str, n: [usize; 2]| Affine::new(params, name, n[0], n[1]);
        Ok(Self {
            layers: [
                layer("encoder.0", [pose, pose_hidden])?.with_relu(),
                layer("encoder.2", [pose_hidden, code])?,
                layer("decoder.0", [code, pose_hidden])?.with_relu(),
                layer("decoder.2", [pose_hidden, pose])?,
            ],
        })
    }

    /// Codes [B, code] of poses [B, pose].
    pub fn encode(&self, poses: &Tensor) -> Result<Tensor> {
        self.layers[1].forward(&self.layers[0].forward(poses)?)?.tanh()
    }

    /// Poses of codes.
    pub fn decode(&self, codes: &Tensor) -> Result<Tensor> {
        self.layers[3].forward(&self.layers[2].forward(codes)?)?.tanh()
    }

    /// Poses that come back, from poses to which the caller has added noise.
    pub fn forward(&self, poses: &Tensor) -> Result<Tensor> {
        self.decode(&self.encode(poses)?)
    }
}

/// `audio_encoder` as in network B, dropout, and `linear` to the code.
pub struct SpeechEncoder {
    audio: ContextEncoder,
    linear: Affine,
    config: Config,
}

impl SpeechEncoder {
    pub fn new(params: &mut Params, config: &Config) -> Result<Self> {
        Ok(Self {
            audio: ContextEncoder::new(params, "audio_encoder", config)?,
            linear: Affine::new(params, "linear", config.hidden, config.code)?,
            config: config.clone(),
        })
    }

    /// Audio [B, T + context - 1, audio] to codes [B, T, code].
    pub fn forward(&self, audio: &Tensor, mode: &mut Mode) -> Result<Tensor> {
        let heard = dropout(&self.audio.forward(audio, mode)?, self.config.dropout, mode)?;
        self.linear.forward(&heard)?.reshape((audio.dim(0)?, (), self.config.code))
    }
}
