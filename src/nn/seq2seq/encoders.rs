//! Encoders of the sequence-to-sequence networks: audio per frame, audio with its context around each pose, words.

use super::config::{Config, Segment, windows};
use crate::Mode;
use crate::ops::affine::Affine;
use crate::ops::batch_norm::BatchNorm;
use crate::ops::recurrent::decoder::{DecoderInputs, DecoderWeights, TruePoses, decode};
use crate::ops::recurrent::gru::{Gru, drop_mask};
use crate::params::{Init, Params};
use candle_core::{Module, Result, Tensor};

/// Encoder of audio per frame: two layers, then a bidirectional GRU of one or more layers. Tensors under `<name>.`:
/// `context` (a GRU over the audio around a frame, if configured), `linear.0` and `linear.2`, each followed by a ReLU,
/// and `gru` with numbered layers.
pub struct FrameEncoder {
    context: Option<Gru>,
    layers: [Affine; 2],
    gru: Vec<Gru>,
    config: Config,
}

impl FrameEncoder {
    pub fn new(params: &mut Params, name: &str, config: &Config) -> Result<Self> {
        let Config { audio, hidden, .. } = *config;
        let mut context = || Gru::new(params, &format!("{name}.context"), [audio, audio], 0, false);
        let context = config.audio_context.then(&mut context).transpose()?;
        let layer = |layer: usize, params: &mut Params| {
            let n_in = if layer == 0 { hidden } else { 2 * hidden };
            Gru::new(params, &format!("{name}.gru"), [n_in, hidden], layer, true)
        };
        Ok(Self {
            context,
            layers: [
                Affine::new(params, &format!("{name}.linear.0"), audio, hidden)?.with_relu(),
                Affine::new(params, &format!("{name}.linear.2"), hidden, hidden)?.with_relu(),
            ],
            gru: (0..config.encoder_layers.max(1)).map(|i| layer(i, params)).collect::<Result<_>>()?,
            config: config.clone(),
        })
    }

    /// Encodes audio [B, T + context - 1, audio] to states [B, T, 2 hidden].
    pub fn forward(&self, audio: &Tensor, mode: &mut Mode) -> Result<Tensor> {
        let (batch, n_frames, n) = audio.dims3()?;
        let around = self.config.context - 1;
        let mut x = match &self.context {
            None => audio.narrow(1, around / 2, n_frames - around)?,
            Some(gru) => {
                let windows = windows(audio, around + 1)?.reshape((batch * (n_frames - around), around + 1, n))?;
                gru.last(&windows)?.reshape((batch, n_frames - around, n))?
            }
        };
        for layer in &self.layers {
            x = layer.forward(&x)?;
        }
        for (i, gru) in self.gru.iter().enumerate() {
            let is_last = i + 1 == self.gru.len();
            x = gru.forward(&x, if is_last { self.config.dropout } else { self.config.dropout_between }, mode)?;
        }
        Ok(x)
    }
}

/// PyTorch's defaults for the batch norms.
pub const EPS: f64 = 1e-5;
const MOMENTUM: f64 = 0.1;

/// Encoder of the audio around each pose: three layers over the frames of its context, normalised per position in the
/// context, a GRU over them, and its last output, normalised. Tensors under `<name>.`: `linear.0` to `.2`; `norm.0` to
/// `.2`, with one channel per position in the context (statistics over batch and features); `gru`; and `norm.3` over
/// the GRU's state.
pub struct ContextEncoder {
    layers: Vec<(Affine, BatchNorm)>,
    gru: Gru,
    norm: BatchNorm,
    dropout: f64,
    width: usize,
}

impl ContextEncoder {
    pub fn new(params: &mut Params, name: &str, config: &Config) -> Result<Self> {
        let Config { audio, hidden, context, dropout, .. } = *config;
        let layer = |i: usize, params: &mut Params| -> Result<_> {
            let n_in = if i == 0 { audio } else { hidden };
            let linear = Affine::new(params, &format!("{name}.linear.{i}"), n_in, hidden)?;
            Ok((linear, BatchNorm::new(params, &format!("{name}.norm.{i}"), context, EPS, MOMENTUM, 0.0)?))
        };
        Ok(Self {
            layers: (0..3).map(|i| layer(i, params)).collect::<Result<_>>()?,
            gru: Gru::new(params, &format!("{name}.gru"), [hidden, hidden], 0, false)?,
            norm: BatchNorm::new(params, &format!("{name}.norm.3"), hidden, EPS, MOMENTUM, 0.0)?,
            dropout,
            width: context,
        })
    }

    /// Encodes the audio [B, T + context - 1, audio] around each of T frames to [B * T, hidden].
    pub fn forward(&self, audio: &Tensor, mode: &mut Mode) -> Result<Tensor> {
        let (batch, n_frames, n) = audio.dims3()?;
        let n_windows = batch * (n_frames + 1 - self.width);
        let mut x = windows(audio, self.width)?.reshape((n_windows, self.width, n))?;
        for (linear, norm) in &self.layers {
            let mask = drop_mask(self.dropout, mode);
            x = norm.forward_dropped(&linear.forward(&x)?, mode.trains(), mask)?;
        }
        self.norm.forward(&self.gru.last(&x)?, mode.trains())
    }
}

/// Encoder of words with trained word vectors. Tensors: `<name>.embedding.weight` [vocabulary, word] with initial
/// values of variance 1, and the bidirectional GRU `<name>.gru`.
pub struct WordEncoder {
    table: Tensor,
    gru: Gru,
}

impl WordEncoder {
    /// Creates an encoder; `n` has the number of words, the sizes of a word vector and a state in one direction.
    pub fn new(params: &mut Params, name: &str, n: [usize; 3]) -> Result<Self> {
        let [vocabulary, word, hidden] = n;
        let table = params.trainable(&table_name(name), &[vocabulary, word], Init::Uniform(3f64.sqrt()))?;
        Ok(Self { table, gru: Gru::new(params, &format!("{name}.gru"), [word, hidden], 0, true)? })
    }

    /// Returns the states [B, W, 2 hidden] of words [B, W].
    pub fn states(&self, words: &Tensor) -> Result<Tensor> {
        self.gru.forward(&self.vectors(words)?, 0.0, &mut Mode::Eval)
    }

    /// Output at the last word, [B, 2 hidden]. Earlier words affect only the forward direction; padding is read too.
    pub fn last(&self, words: &Tensor) -> Result<Tensor> {
        self.gru.last(&self.vectors(words)?)
    }

    fn vectors(&self, words: &Tensor) -> Result<Tensor> {
        let (batch, n_words) = words.dims2()?;
        let vectors = self.table.index_select(&words.flatten_all()?, 0)?;
        vectors.reshape((batch, n_words, self.table.dim(1)?))
    }
}

pub fn table_name(encoder: &str) -> String {
    format!("{encoder}.embedding.weight")
}

/// Sets the word vectors [vocabulary, word] of the word encoder `name`.
///
/// # Errors
/// There is no such encoder, or its vectors have another shape.
pub fn set_word_vectors(params: &Params, name: &str, vectors: &Tensor) -> Result<()> {
    let table = table_name(name);
    match params.trainables().find(|(own, _)| *own == table) {
        Some((_, var)) => var.set(&vectors.to_dtype(var.dtype())?.to_device(var.device())?),
        None => candle_core::bail!("the network has no tensor {table}"),
    }
}

/// Tensors under `<name>.`: `init` from the encoder's last states to the initial state, `gru`, `attention` (and
/// `word_attention`) from encoder states to keys, `output` from state and contexts to a pose.
pub struct Decoder {
    init: Affine,
    gru: Gru,
    attentions: Vec<Affine>,
    output: Affine,
    n_steps: usize,
    dropout: f64,
}

impl Decoder {
    /// Creates a decoder. `n_encoded` has the state size of each encoded sequence, the audio's first; `dropout` is the
    /// rate for state and contexts.
    pub fn new(params: &mut Params, name: &str, config: &Config, n_encoded: &[usize], dropout: f64) -> Result<Self> {
        let (pose, hidden) = (config.pose, config.hidden);
        let kinds = ["attention", "word_attention"];
        let attentions =
            n_encoded.iter().zip(kinds).map(|(n, kind)| Affine::new(params, &format!("{name}.{kind}"), *n, hidden));
        let attentions = attentions.collect::<Result<Vec<_>>>()?;
        let n_read = (1 + attentions.len()) * hidden;
        Ok(Self {
            attentions,
            init: Affine::new(params, &format!("{name}.init"), 2 * hidden, hidden)?,
            gru: Gru::new(params, &format!("{name}.gru"), [pose, hidden], 0, false)?,
            output: Affine::new(params, &format!("{name}.output"), n_read, pose)?,
            n_steps: config.predicted,
            dropout,
        })
    }

    /// Predicts the poses [B, predicted, pose] that follow those of the segment. `encoded` has sequences [B, K, n];
    /// the first is the audio, whose last forward state and first backward state give the initial state. Steps read
    /// the poses of `truth`, if given, where they are taken.
    pub fn forward(
        &self,
        segment: &Segment,
        encoded: &[Tensor],
        truth: Option<&TruePoses>,
        mode: &mut Mode,
    ) -> Result<Tensor> {
        self.decode(&segment.previous, &self.first_state(encoded)?, encoded, truth, mode)
    }

    /// Predicts poses as `forward` does, without dropout, and returns the state [B, hidden] after reading all but the
    /// last. `state`, that of the previous segment, replaces the initial one and all previous poses but the last.
    pub fn continue_from(
        &self,
        segment: &Segment,
        encoded: &[Tensor],
        state: Option<&Tensor>,
    ) -> Result<(Tensor, Tensor)> {
        let n_previous = segment.previous.dim(1)?;
        let last = segment.previous.narrow(1, n_previous - 1, 1)?.contiguous()?;
        let (previous, state) = match state {
            Some(state) => (last.clone(), state.clone()),
            None => (segment.previous.clone(), self.first_state(encoded)?),
        };
        let poses = self.decode(&previous, &state, encoded, None, &mut Mode::Eval)?;
        let read = Tensor::cat(&[&previous, &last, &poses.narrow(1, 0, self.n_steps - 1)?], 1)?;
        let state = self.gru.state_after(&read, &state)?;
        Ok((poses, state))
    }

    /// State before the first pose, from the ends of both directions of the first encoder output.
    pub fn first_state(&self, encoded: &[Tensor]) -> Result<Tensor> {
        let Some(sound) = encoded.first() else { candle_core::bail!("decoder: expected at least one encoder output") };
        let (_, n, both) = sound.dims3()?;
        let end = sound.narrow(1, n - 1, 1)?.narrow(2, 0, both / 2)?;
        let beginning = sound.narrow(1, 0, 1)?.narrow(2, both / 2, both / 2)?;
        self.init.forward(&Tensor::cat(&[end, beginning], 2)?.squeeze(1)?)
    }

    /// Poses that follow `previous`, which are read first, from `state` on; `truth` as in [`Self::forward`].
    pub fn decode(
        &self,
        previous: &Tensor,
        state: &Tensor,
        encoded: &[Tensor],
        truth: Option<&TruePoses>,
        mode: &mut Mode,
    ) -> Result<Tensor> {
        let keys = self.attentions.iter().zip(encoded).map(|(attention, states)| attention.forward(states));
        let keys = keys.collect::<Result<Vec<_>>>()?;
        let inputs = DecoderInputs { previous, state, keys: &keys, truth };
        let gru = self.gru.flat_weights()?;
        let weights = DecoderWeights { gru: &gru, weight: self.output.weight(), bias: self.output.bias() };
        decode(&inputs, &weights, self.n_steps, drop_mask(self.dropout, mode))
    }
}
