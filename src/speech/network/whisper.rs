//! Encoder and decoder of one network, and the attention that aligns tokens with time.

use super::config::WhisperConfig;
use super::decoder::{TextDecoder, TokenDecoder};
use super::encoder::AudioEncoder;
use super::layers::PackedHead;
use super::weight_file::WeightFile;
use anyhow::{Context, Result, ensure};
use ndarray::{Array2, Array3, ArrayView2, s};
use std::path::Path;

/// A Whisper network (Radford et al. 2022), with weights of f32. Results do not depend on the number of threads.
pub struct Whisper {
    config: WhisperConfig,
    encoder: AudioEncoder,
    pub(super) decoder: TextDecoder,
}

/// A window of encoded sound.
pub struct EncodedAudio {
    /// Output of the encoder, [positions, width].
    pub states: Array2<f32>,
    /// Keys and values of the decoder's cross-attention per layer and head.
    pub(super) cross_heads: Vec<Vec<PackedHead>>,
}

/// Cross-attention and logits of a sequence of tokens.
pub struct TokenAttention {
    /// Scaled scores before the softmax, [alignment heads, tokens, positions].
    pub weights: Array3<f32>,
    /// Logits after each token, [tokens, vocabulary].
    pub logits: Array2<f32>,
}

impl Whisper {
    /// Reads a network from a folder: `model.bin` and `config.json` of CTranslate2 (faster-whisper), or
    /// `model.safetensors`, `config.json` and `generation_config.json` of transformers, with weights of f32 or f16.
    ///
    /// # Errors
    /// A file is missing, damaged or of another type of network; the message names it.
    pub fn open(dir: &Path) -> Result<Self> {
        let read = || {
            let weights = WeightFile::open(dir)?;
            let config = WhisperConfig::read(dir, &weights)?;
            let decoder = TextDecoder::read(&weights, &config)?;
            let encoder = AudioEncoder::read(&weights, &config)?;
            anyhow::Ok(Self { config, encoder, decoder })
        };
        read().with_context(|| format!("{} has no usable Whisper network", dir.display()))
    }

    pub fn config(&self) -> &WhisperConfig {
        &self.config
    }

    /// Encodes a spectrogram of [`crate::mel::log_mel`], [80, 3000].
    ///
    /// # Errors
    /// The spectrogram has another size.
    pub fn encode(&self, mel: ArrayView2<f32>) -> Result<EncodedAudio> {
        let expected = (self.config.n_mels, 2 * self.config.n_audio_frames);
        ensure!(mel.dim() == expected, "the spectrogram has size {:?}, expected {expected:?}", mel.dim());
        let states = self.encoder.encode(mel);
        let cross_heads = self.decoder.cross_heads(&states);
        let states = Array2::from_shape_vec((self.config.n_audio_frames, self.config.width), states)?;
        Ok(EncodedAudio { states, cross_heads })
    }

    /// Starts decoding a window, with one beam that has no tokens.
    pub fn decoder<'a>(&'a self, audio: &'a EncodedAudio) -> TokenDecoder<'a> {
        TokenDecoder { whisper: self, audio, beams: vec![self.decoder.empty_cache()] }
    }

    /// Computes attention and logits of `tokens`, which include the prompt.
    ///
    /// # Errors
    /// Those of [`TokenDecoder::step`].
    pub fn token_attention(&self, audio: &EncodedAudio, tokens: &[u32]) -> Result<TokenAttention> {
        let heads = &self.config.alignment_heads;
        let mut beams = [self.decoder.empty_cache()];
        let (states, scores) =
            self.decoder.advance(audio, &mut beams, &[tokens.to_vec()], |head| heads.contains(&head))?;
        let mut weights = Array3::zeros((heads.len(), tokens.len(), self.config.n_audio_frames));
        for (i, head) in heads.iter().enumerate() {
            let Some((_, scores)) = scores.iter().find(|(found, _)| found == head) else { continue };
            weights.slice_mut(s![i, .., ..]).iter_mut().zip(scores).for_each(|(to, score)| *to = *score);
        }
        Ok(TokenAttention { weights, logits: self.decoder.logits(&states)? })
    }
}
