//! A fully connected layer.

use crate::params::{Init, Params};
use candle_core::{Module, Result, Tensor};

/// `<name>.weight` [out, in] and `<name>.bias` [out].
pub struct Linear {
    weight: Tensor,
    bias: Tensor,
}

impl Linear {
    /// Weights He uniform, bias zero.
    pub fn new(params: &mut Params, name: &str, n_in: usize, n_out: usize) -> Result<Self> {
        Self::with_init(params, name, [n_in, n_out], Init::He, 0.0)
    }

    /// With these first values of weight and bias.
    pub fn with_init(
        params: &mut Params,
        name: &str,
        [n_in, n_out]: [usize; 2],
        weight: Init,
        bias: f64,
    ) -> Result<Self> {
        Ok(Self {
            weight: params.trainable(&format!("{name}.weight"), &[n_out, n_in], weight)?,
            bias: params.trainable(&format!("{name}.bias"), &[n_out], Init::Constant(bias))?,
        })
    }
}

impl Module for Linear {
    /// [B, in] to [B, out].
    fn forward(&self, x: &Tensor) -> Result<Tensor> {
        x.contiguous()?.matmul(&self.weight.t()?)?.broadcast_add(&self.bias)
    }
}
