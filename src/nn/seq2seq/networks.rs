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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::gradcheck::pattern;
    use crate::seq2seq::autoencoder::AudioBaseline;
    use candle_core::{DType, Device};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn small() -> Config {
        let sizes = Config { pose: 2, audio: 3, context: 5, previous: 3, predicted: 4, ..Config::default() };
        Config { hidden: 6, vocabulary: 4, word: 3, word_hidden: 3, ..sizes }
    }

    fn values(shape: [usize; 2], phase: f64) -> Result<Tensor> {
        pattern(&[2, shape[0], shape[1]], phase)?.to_dtype(DType::F32)
    }

    fn segment(words: Option<Tensor>) -> Result<Segment> {
        Ok(Segment { audio: values([8, 3], 0.0)?, previous: values([3, 2], 1.0)?, words })
    }

    #[test]
    fn training_is_unchanged_unless_true_poses_are_taken() -> Result<()> {
        let mut params = [Params::new(3), Params::new(4), Params::new(5)];
        let networks: [Box<dyn GesturePredictor>; 3] = [
            Box::new(WordsSeq2Seq::new(&mut params[0], &small())?),
            Box::new(WordsSeq2Seq::audio_only(&mut params[1], &small())?),
            Box::new(ContextSeq2Seq::new(&mut params[2], &small())?),
        ];
        let of_segments = Tensor::new(&[[2u32, 0, 3], [1, 2, 2]], &Device::Cpu)?;
        let of_poses = Tensor::ones((2, 4, 3), DType::U32, &Device::Cpu)?;
        let poses = values([4, 2], 2.0)?;
        for ((network, params), words) in networks.iter().zip(&params).zip([Some(of_segments), None, Some(of_poses)]) {
            let segment = segment(words)?;
            // Poses, then gradients.
            let train = |taken: Option<&[bool]>| -> Result<Vec<Vec<f32>>> {
                let mut rng = ChaCha8Rng::seed_from_u64(1);
                let mut mode = Mode::Train(&mut rng);
                let predicted = match taken {
                    None => network.forward(&segment, &mut mode)?,
                    Some(taken) => {
                        network.forward_with_truth(&segment, &TruePoses { poses: &poses, taken }, &mut mode)?
                    }
                };
                let gradients = predicted.sqr()?.sum_all()?.backward()?;
                let of_params = params.trainables().filter_map(|(_, var)| gradients.get(var));
                std::iter::once(&predicted).chain(of_params).map(|v| v.flatten_all()?.to_vec1()).collect()
            };
            let without = train(None)?;
            assert_eq!(without.len(), 1 + params.trainables().count());
            assert_eq!(without, train(Some(&[false; 8]))?);
            // Only the inputs of the second sample's last two steps are true poses.
            let with = train(Some(&[true, false, false, false, true, false, true, true]))?;
            assert_eq!(without[0][..12], with[0][..12]);
            assert!((12..16).all(|i| without[0][i] != with[0][i]), "{without:?} {with:?}");
            assert!(train(Some(&[false; 7])).is_err());
        }
        Ok(())
    }

    #[test]
    fn networks_without_a_decoder_read_no_true_poses() -> Result<()> {
        let network = AudioBaseline::new(&mut Params::new(1), &small())?;
        let truth = TruePoses { poses: &values([4, 2], 2.0)?, taken: &[true; 8] };
        assert!(network.forward(&segment(None)?, &mut Mode::Eval).is_ok());
        let result = network.forward_with_truth(&segment(None)?, &truth, &mut Mode::Eval);
        assert!(result.is_err_and(|error| error.to_string().contains("no decoder")));
        Ok(())
    }

    #[test]
    fn the_network_without_words_has_two_encoder_layers_and_one_attention() -> Result<()> {
        let config = Config { dropout_between: 0.0, dropout: 0.0, ..small() };
        type Build = fn(&mut Params, &Config) -> Result<WordsSeq2Seq>;
        let names = |build: Build| -> Result<Vec<String>> {
            let mut params = Params::new(1);
            build(&mut params, &config)?;
            Ok(params.trainables().map(|(name, _)| name.to_owned()).collect())
        };
        let without = |names: Vec<String>, part: &str| -> Vec<String> {
            names.into_iter().filter(|name| !name.contains(part)).collect()
        };
        let audio_only = names(WordsSeq2Seq::audio_only)?;
        assert_eq!(audio_only, without(names(WordsSeq2Seq::new)?, "word_"));
        assert_eq!(audio_only.iter().filter(|name| name.starts_with("encoder.gru.weight_hh_l1")).count(), 2);
        assert_eq!(names(WordsSeq2Seq::without_words)?, without(audio_only, "_l1"));

        let mut params = Params::new(1);
        let network = WordsSeq2Seq::audio_only(&mut params, &config)?;
        assert_eq!(params.tensors()?["decoder.output.weight"].dims(), [2, 12]);
        let predicted = network.forward(&segment(None)?, &mut Mode::Eval)?;
        assert_eq!(predicted.dims(), [2, 4, 2]);
        // The default dropout before the output belongs to the network with words.
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let trained = network.forward(&segment(None)?, &mut Mode::Train(&mut rng))?;
        assert_eq!(trained.to_vec3::<f32>()?, predicted.to_vec3::<f32>()?);
        let words = Tensor::new(&[[2u32], [1]], &Device::Cpu)?;
        assert!(network.forward(&segment(Some(words))?, &mut Mode::Eval).is_err());
        Ok(())
    }
}
