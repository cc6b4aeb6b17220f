//! The networks with encoders and the common decoder: `WordsSeq2Seq` (network A) and `ContextSeq2Seq` (network B).

use super::config::{Config, Segment};
use super::encoders::{ContextEncoder, Decoder, FrameEncoder, WordEncoder};
use super::predict::{GesturePredictor, TruePoses};
use crate::Mode;
use crate::ops::affine::Affine;
use crate::ops::recurrent::gru::Gru;
use crate::params::Params;
use candle_core::{Module, Result, Tensor};

/// A network of encoders and a decoder that attends to the encoded sequences.
trait EncodesAndDecodes: Send + Sync {
    fn parts(&self) -> (&Config, &Decoder);

    fn encoded(&self, segment: &Segment, mode: &mut Mode) -> Result<Vec<Tensor>>;
}

impl<N: EncodesAndDecodes> GesturePredictor for N {
    fn config(&self) -> &Config {
        self.parts().0
    }

    fn forward(&self, segment: &Segment, mode: &mut Mode) -> Result<Tensor> {
        let encoded = self.encoded(segment, mode)?;
        self.parts().1.forward(segment, &encoded, None, mode)
    }

    fn forward_with_truth(&self, segment: &Segment, truth: &TruePoses, mode: &mut Mode) -> Result<Tensor> {
        let encoded = self.encoded(segment, mode)?;
        self.parts().1.forward(segment, &encoded, Some(truth), mode)
    }

    fn continue_from(&self, segment: &Segment, state: Option<&Tensor>) -> Result<(Tensor, Option<Tensor>)> {
        let encoded = self.encoded(segment, &mut Mode::Eval)?;
        let (poses, state) = self.parts().1.continue_from(segment, &encoded, state)?;
        Ok((poses, Some(state)))
    }
}

/// Network A: a segment's audio per frame and its words, with attention over both; or audio only, also with one encoder
/// layer as the generator of the adversarial network. Tensors: `encoder`, `word_encoder` (with words), `decoder`.
pub struct WordsSeq2Seq {
    encoder: FrameEncoder,
    words: Option<WordEncoder>,
    decoder: Decoder,
    config: Config,
}

impl WordsSeq2Seq {
    /// Creates the published network, with two attentions.
    pub fn new(params: &mut Params, config: &Config) -> Result<Self> {
        let n = [config.vocabulary, config.word, config.word_hidden];
        let words = WordEncoder::new(params, "word_encoder", n)?;
        Self::with(params, config, Some(words), &[2 * config.hidden, 2 * config.word_hidden])
    }

    /// Creates the published network without words, with one attention and no dropout before the output.
    pub fn audio_only(params: &mut Params, config: &Config) -> Result<Self> {
        let config = Config { dropout_read: 0.0, ..config.clone() };
        Self::with(params, &config, None, &[2 * config.hidden])
    }

    /// Creates [`Self::audio_only`] with one encoder layer, for the adversarial training of `adversarial`.
    pub fn without_words(params: &mut Params, config: &Config) -> Result<Self> {
        Self::audio_only(params, &Config { encoder_layers: 1, ..config.clone() })
    }

    fn with(params: &mut Params, config: &Config, words: Option<WordEncoder>, n_encoded: &[usize]) -> Result<Self> {
        Ok(Self {
            encoder: FrameEncoder::new(params, "encoder", config)?,
            words,
            decoder: Decoder::new(params, "decoder", config, n_encoded, config.dropout_read)?,
            config: config.clone(),
        })
    }
}

impl EncodesAndDecodes for WordsSeq2Seq {
    fn parts(&self) -> (&Config, &Decoder) {
        (&self.config, &self.decoder)
    }

    /// Returns the states of the audio, and of the words if the network reads them.
    fn encoded(&self, segment: &Segment, mode: &mut Mode) -> Result<Vec<Tensor>> {
        self.config.check(segment)?;
        let mut encoded = vec![self.encoder.forward(&segment.audio, mode)?];
        match (&self.words, &segment.words) {
            (Some(encoder), Some(words)) => encoded.push(encoder.states(words)?),
            (None, None) => {}
            (Some(_), None) => candle_core::bail!("the input has no words: this network requires them"),
            (None, Some(_)) => candle_core::bail!("the input has words: this network does not use them"),
        }
        Ok(encoded)
    }
}

/// Network B, the submitted one: audio and words around each frame, encoded over the frames of a segment. Tensors:
/// `audio_encoder`, `word_encoder`, `linear` over the concatenation of both, `gru` over the frames, `decoder`.
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
}

impl EncodesAndDecodes for ContextSeq2Seq {
    fn parts(&self) -> (&Config, &Decoder) {
        (&self.config, &self.decoder)
    }

    fn encoded(&self, segment: &Segment, mode: &mut Mode) -> Result<Vec<Tensor>> {
        self.config.check(segment)?;
        let Some(words) = &segment.words else {
            candle_core::bail!("the input has no words: expected those around each pose")
        };
        let (batch, n_frames, n_words) = words.dims3()?;
        if n_frames != self.config.predicted {
            candle_core::bail!("the input has words for {n_frames} frames, expected {} poses", self.config.predicted);
        }
        let audio = self.audio.forward(&segment.audio, mode)?;
        let spoken = self.words.last(&words.reshape((batch * n_frames, n_words))?)?.relu()?;
        let frames = self.linear.forward(&Tensor::cat(&[audio, spoken], 1)?)?;
        let frames = frames.reshape((batch, n_frames, self.config.hidden))?;
        Ok(vec![self.gru.forward(&frames, self.config.dropout, mode)?])
    }
}
