//! Encoders of the sequence-to-sequence networks: audio per frame, audio with its context around each pose, words.

use super::config::{Config, windows};
use crate::Mode;
use crate::ops::affine::Affine;
use crate::ops::batch_norm::BatchNorm;
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

/// PyTorch's defaults.
const EPS: f64 = 1e-5;
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
    /// Creates an encoder; `n` has the number of words, the size of a word vector and the size of a state in one
    /// direction.
    pub fn new(params: &mut Params, name: &str, n: [usize; 3]) -> Result<Self> {
        let [vocabulary, word, hidden] = n;
        let table = params.trainable(&table_name(name), &[vocabulary, word], Init::Uniform(3f64.sqrt()))?;
        Ok(Self { table, gru: Gru::new(params, &format!("{name}.gru"), [word, hidden], 0, true)? })
    }

    /// Returns the states [B, W, 2 hidden] of words [B, W].
    pub fn states(&self, words: &Tensor) -> Result<Tensor> {
        self.gru.forward(&self.vectors(words)?, 0.0, &mut Mode::Eval)
    }

    /// Returns the output at the last word, [B, 2 hidden]. Earlier words affect only the forward direction; padding is
    /// read like a word.
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

#[cfg(test)]
mod tests {
    use super::*;
    use candle_core::Device;

    #[test]
    fn word_vectors_are_set_for_the_named_encoder_only() -> Result<()> {
        let mut params = Params::new(1);
        let encoder = WordEncoder::new(&mut params, "spoken", [3, 2, 4])?;
        let states = |word: u32| encoder.last(&Tensor::new(&[[word]], &Device::Cpu)?)?.flatten_all()?.to_vec1::<f32>();
        let before = states(1)?;
        let vectors = Tensor::new(&[[0f64, 0.0], [1.0, 1.0], [0.5, -2.0]], &Device::Cpu)?;
        set_word_vectors(&params, "spoken", &vectors)?;
        let table = params.trainables().find(|(name, _)| *name == "spoken.embedding.weight").map(|(_, var)| var);
        assert_eq!(
            table.map(|var| var.to_vec2::<f32>()).transpose()?,
            Some(vec![vec![0.0; 2], vec![1.0; 2], vec![0.5, -2.0]])
        );
        assert!(states(1)? != before && states(1)? != states(2)?);
        for (name, shape) in [("other", (3, 2)), ("spoken", (2, 2)), ("spoken", (3, 3)), ("spoken", (2, 3))] {
            assert!(set_word_vectors(&params, name, &Tensor::zeros(shape, vectors.dtype(), &Device::Cpu)?).is_err());
        }
        assert!(encoder.last(&Tensor::new(&[[3u32]], &Device::Cpu)?).is_err());
        Ok(())
    }
}
