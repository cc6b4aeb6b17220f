//! Network A: the sound of a segment frame by frame and its words, with an attention over each. Without words and with
//! one layer it is the generator of the adversarial network.

use super::config::{Config, Segment};
use super::decoder::Decoder;
use super::embedding::WordEncoder;
use super::encoder::FrameEncoder;
use super::predict::GesturePredictor;
use crate::Mode;
use crate::params::Params;
use candle_core::{Result, Tensor};

/// `encoder`, `word_encoder` where words are read, `decoder`.
pub struct WordsSeq2Seq {
    encoder: FrameEncoder,
    words: Option<WordEncoder>,
    decoder: Decoder,
    config: Config,
}

impl WordsSeq2Seq {
    /// The published network: two attentions.
    pub fn new(params: &mut Params, config: &Config) -> Result<Self> {
        let n = [config.vocabulary, config.word, config.word_hidden];
        let words = WordEncoder::new(params, "word_encoder", n)?;
        Self::with(params, config, Some(words), &[2 * config.hidden, 2 * config.word_hidden])
    }

    /// The network without words, for the adversarial training of `adversarial`; its encoder has one layer.
    pub fn without_words(params: &mut Params, config: &Config) -> Result<Self> {
        let config = Config { encoder_layers: 1, dropout_read: 0.0, ..config.clone() };
        Self::with(params, &config, None, &[2 * config.hidden])
    }

    fn with(params: &mut Params, config: &Config, words: Option<WordEncoder>, n_encoded: &[usize]) -> Result<Self> {
        Ok(Self {
            encoder: FrameEncoder::new(params, "encoder", config)?,
            words,
            decoder: Decoder::new(params, "decoder", config, n_encoded, config.dropout_read)?,
            config: config.clone(),
        })
    }

    /// States of the sound, and of the words where they are read.
    fn encoded(&self, segment: &Segment, mode: &mut Mode) -> Result<Vec<Tensor>> {
        self.config.check(segment)?;
        let mut encoded = vec![self.encoder.forward(&segment.audio, mode)?];
        match (&self.words, &segment.words) {
            (Some(encoder), Some(words)) => encoded.push(encoder.states(words)?),
            (None, None) => {}
            (reads, _) => {
                candle_core::bail!("this network reads {} words", if reads.is_some() { "a segment's" } else { "no" })
            }
        }
        Ok(encoded)
    }
}

impl GesturePredictor for WordsSeq2Seq {
    fn config(&self) -> &Config {
        &self.config
    }

    fn forward(&self, segment: &Segment, mode: &mut Mode) -> Result<Tensor> {
        let encoded = self.encoded(segment, mode)?;
        self.decoder.forward(segment, &encoded, mode)
    }

    fn go_on(&self, segment: &Segment, state: Option<&Tensor>) -> Result<(Tensor, Option<Tensor>)> {
        let encoded = self.encoded(segment, &mut Mode::Eval)?;
        let (poses, state) = self.decoder.go_on(segment, &encoded, state)?;
        Ok((poses, Some(state)))
    }
}
