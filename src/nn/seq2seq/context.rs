//! What is heard around each pose: three layers over the frames of its context, normalised per place of the context, a
//! GRU over them, and its last output, normalised.

use super::config::{Config, windows};
use crate::Mode;
use crate::ops::affine::Affine;
use crate::ops::batch_norm::BatchNorm;
use crate::ops::recurrent::gru::{Gru, drop_mask};
use crate::params::Params;
use candle_core::{Module, Result, Tensor};

/// PyTorch's defaults.
const EPS: f64 = 1e-5;
const MOMENTUM: f64 = 0.1;

/// Under `<name>.`: `linear.0` to `.2`, `norm.0` to `.2` with a channel a place of the context (statistics over batch and
/// features), `gru`, and `norm.3` over the GRU's numbers.
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

    /// Audio [B, T + context - 1, audio] to what is heard around each of T frames, [B * T, hidden].
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
