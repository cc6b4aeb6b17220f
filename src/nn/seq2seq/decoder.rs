//! The common decoder of all sequence-to-sequence networks.

use super::config::{Config, Segment};
use crate::Mode;
use crate::ops::affine::Affine;
use crate::ops::recurrent::decoder::{DecoderInputs, DecoderWeights, TruePoses, decode};
use crate::ops::recurrent::gru::{Gru, drop_mask};
use crate::params::Params;
use candle_core::{Module, Result, Tensor};

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

    /// Predicts poses as `forward` does, without dropout, and returns the state [B, hidden] after reading all of them
    /// except the last. `state` is the state of the previous segment; it replaces the initial state and all previous
    /// poses except the last.
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

    fn first_state(&self, encoded: &[Tensor]) -> Result<Tensor> {
        let Some(sound) = encoded.first() else { candle_core::bail!("decoder: expected at least one encoder output") };
        let (_, n, both) = sound.dims3()?;
        let end = sound.narrow(1, n - 1, 1)?.narrow(2, 0, both / 2)?;
        let beginning = sound.narrow(1, 0, 1)?.narrow(2, both / 2, both / 2)?;
        self.init.forward(&Tensor::cat(&[end, beginning], 2)?.squeeze(1)?)
    }

    fn decode(
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::gradcheck::pattern;

    #[test]
    fn a_carried_state_has_read_all_poses_since_the_initial_state() -> Result<()> {
        let config = Config { pose: 3, hidden: 4, previous: 5, predicted: 6, ..Config::default() };
        let decoder = Decoder::new(&mut Params::with_dtype(1, candle_core::DType::F64), "decoder", &config, &[8], 0.0)?;
        let encoded = [pattern(&[2, 6, 8], 0.0)?];
        let segment = |previous: Tensor| Segment { audio: encoded[0].clone(), previous, words: None };
        let first = segment(pattern(&[2, 5, 3], 1.0)?);
        let (poses, state) = decoder.continue_from(&first, &encoded, None)?;
        let max_difference = |a: &Tensor, b: &Tensor| (a - b)?.abs()?.max_all()?.to_scalar::<f64>();
        assert!(max_difference(&poses, &decoder.forward(&first, &encoded, None, &mut Mode::Eval)?)? < 1e-12);
        let (carried, _) = decoder.continue_from(&segment(poses.narrow(1, 1, 5)?), &encoded, Some(&state))?;
        // The first pose is read twice, as is the last pose before any segment.
        let read = Tensor::cat(&[&first.previous, &first.previous.narrow(1, 4, 1)?, &poses], 1)?;
        let all = decoder.decode(&read, &decoder.first_state(&encoded)?, &encoded, None, &mut Mode::Eval)?;
        assert!(max_difference(&carried, &all)? < 1e-12);
        let renewed = decoder.forward(&segment(poses.narrow(1, 1, 5)?), &encoded, None, &mut Mode::Eval)?;
        assert!(max_difference(&carried, &renewed)? > 1e-6);
        Ok(())
    }
}
