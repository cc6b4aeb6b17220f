//! The decoder that all sequence-to-sequence networks share.

use super::config::{Config, Segment};
use crate::nn::Mode;
use crate::nn::ops::affine::Affine;
use crate::nn::ops::recurrent::decoder::{DecoderInputs, DecoderWeights, decode};
use crate::nn::ops::recurrent::gru::{Gru, drop_mask};
use crate::nn::params::Params;
use candle_core::{Module, Result, Tensor};

/// Under `<name>.`: `init` from the encoder's last states to the first state, `gru`, `attention` (and `word_attention`)
/// from encoder states to keys, `output` from state and contexts to a pose.
pub struct Decoder {
    init: Affine,
    gru: Gru,
    attentions: Vec<Affine>,
    output: Affine,
    n_steps: usize,
    dropout: f64,
}

impl Decoder {
    /// `n_encoded`: numbers of a state of each encoded sequence, the sound's first. `dropout`: of state and contexts.
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

    /// Poses [B, predicted, pose] after those of the segment. `encoded`: sequences [B, K, n]; the first is the sound, whose
    /// forward state at its end and backward state at its beginning make the first state.
    pub fn forward(&self, segment: &Segment, encoded: &[Tensor], mode: &mut Mode) -> Result<Tensor> {
        let Some(sound) = encoded.first() else { candle_core::bail!("a decoder without encoder") };
        let (_, n, both) = sound.dims3()?;
        let end = sound.narrow(1, n - 1, 1)?.narrow(2, 0, both / 2)?;
        let beginning = sound.narrow(1, 0, 1)?.narrow(2, both / 2, both / 2)?;
        let state = self.init.forward(&Tensor::cat(&[end, beginning], 2)?.squeeze(1)?)?;
        let keys = self.attentions.iter().zip(encoded).map(|(attention, states)| attention.forward(states));
        let keys = keys.collect::<Result<Vec<_>>>()?;
        let inputs = DecoderInputs { previous: &segment.previous, state: &state, keys: &keys };
        let gru = self.gru.flat_weights()?;
        let weights = DecoderWeights { gru: &gru, weight: self.output.weight(), bias: self.output.bias() };
        decode(&inputs, &weights, self.n_steps, drop_mask(self.dropout, mode))
    }
}
