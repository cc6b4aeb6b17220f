//! Network B, which was submitted: what is heard and said around each frame, encoded over the frames of a segment.

use super::config::{Config, Segment};
use super::context::ContextEncoder;
use super::decoder::Decoder;
use super::embedding::WordEncoder;
use super::predict::GesturePredictor;
use crate::Mode;
use crate::ops::affine::Affine;
use crate::ops::recurrent::gru::Gru;
use crate::params::Params;
use candle_core::{Module, Result, Tensor};

/// `audio_encoder`, `word_encoder`, `linear` over both side by side, `gru` over the frames, `decoder`.
pub struct ContextSeq2Seq {
    audio: ContextEncoder,
    words: WordEncoder,
    linear: Affine,
    gru: Gru,
    decoder: Decoder,
    config: Config,
}

impl ContextSeq2Seq {
    pub fn new(params: &mut Params, config: &Config) -> Result<Self> {
        let Config { hidden, vocabulary, word, word_hidden, .. } = *config;
        Ok(Self {
            audio: ContextEncoder::new(params, "audio_encoder", config)?,
            words: WordEncoder::new(params, "word_encoder", [vocabulary, word, word_hidden])?,
            linear: Affine::new(params, "linear", hidden + 2 * word_hidden, hidden)?,
            gru: Gru::new(params, "gru", [hidden, hidden], 0, true)?,
            decoder: Decoder::new(params, "decoder", config, &[2 * hidden], 0.0)?,
            config: config.clone(),
        })
    }

    /// States over the frames of the segment.
    fn encoded(&self, segment: &Segment, mode: &mut Mode) -> Result<Tensor> {
        self.config.check(segment)?;
        let Some(words) = &segment.words else { candle_core::bail!("this network reads the words around each pose") };
        let (batch, n_frames, n_words) = words.dims3()?;
        if n_frames != self.config.predicted {
            candle_core::bail!("words of {n_frames} frames for {} poses", self.config.predicted);
        }
        let heard = self.audio.forward(&segment.audio, mode)?;
        let said = self.words.last(&words.reshape((batch * n_frames, n_words))?)?.relu()?;
        let frames = self.linear.forward(&Tensor::cat(&[heard, said], 1)?)?;
        let frames = frames.reshape((batch, n_frames, self.config.hidden))?;
        self.gru.forward(&frames, self.config.dropout, mode)
    }
}

impl GesturePredictor for ContextSeq2Seq {
    fn config(&self) -> &Config {
        &self.config
    }

    fn forward(&self, segment: &Segment, mode: &mut Mode) -> Result<Tensor> {
        let encoded = self.encoded(segment, mode)?;
        self.decoder.forward(segment, &[encoded], mode)
    }

    fn go_on(&self, segment: &Segment, state: Option<&Tensor>) -> Result<(Tensor, Option<Tensor>)> {
        let encoded = self.encoded(segment, &mut Mode::Eval)?;
        let (poses, state) = self.decoder.go_on(segment, &[encoded], state)?;
        Ok((poses, Some(state)))
    }
}
