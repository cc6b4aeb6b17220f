//! The encoder of sound frame by frame: two layers, then a GRU of one or two layers in both directions.

use super::config::{Config, windows};
use crate::Mode;
use crate::ops::affine::Affine;
use crate::ops::recurrent::gru::Gru;
use crate::params::Params;
use candle_core::{Module, Result, Tensor};

/// Under `<name>.`: `context` (a GRU over the audio around a frame, where asked for), `linear.0` and `linear.2` with
/// ReLUs, and `gru`, its layers numbered.
pub struct FrameEncoder {
    context: Option<Gru>,
    layers: [Affine; 2],
    gru: Vec<Gru>,
    config: Config,
}

impl FrameEncoder {
    pub fn new(params: &mut Params, name: &str, config: &Config) -> Result<Self> {
        let Config { audio, hidden, .. } = *config;
        let context = match config.hears_context {
            true => Some(Gru::new(params, &format!("{name}.context"), [audio, audio], 0, false)?),
            false => None,
        };
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

    /// Audio [B, T + context - 1, audio] to states [B, T, 2 hidden].
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
