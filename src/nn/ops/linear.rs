//! A fully connected layer.

use crate::nn::params::{Init, Params};
use candle_core::{Result, Tensor};

/// `<name>.weight` [out, in] (He uniform) and `<name>.bias` [out] (zero).
pub struct Linear {
    weight: Tensor,
    bias: Tensor,
}

impl Linear {
    pub fn new(params: &mut Params, name: &str, n_in: usize, n_out: usize) -> Result<Self> {
        Ok(Self {
            weight: params.trainable(&format!("{name}.weight"), &[n_out, n_in], Init::He)?,
            bias: params.trainable(&format!("{name}.bias"), &[n_out], Init::Constant(0.0))?,
        })
    }

    /// [B, in] to [B, out].
    pub fn forward(&self, x: &Tensor) -> Result<Tensor> {
        x.contiguous()?.matmul(&self.weight.t()?)?.broadcast_add(&self.bias)
    }
}
