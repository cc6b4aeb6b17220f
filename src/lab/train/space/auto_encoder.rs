//! The auto-encoder of motion windows: the motion encoder of the metrics, and the decoder it is trained with.

use candle_core::{Module, Result, Tensor};
use candle_nn::Linear;
use orator_nn::Mode;
use orator_nn::motion_encoder::{Config, LAST, MotionEncoder, N_CODE, SLOPE, WINDOW, dense, norm, through};
use orator_nn::ops::batch_norm::BatchNorm;
use orator_nn::ops::conv1d::Conv1d;
use orator_nn::params::Params;

/// Prefix of the decoder's tensors.
const DECODER: &str = "decoder.";

/// Encoder and decoder, trained together.
pub struct AutoEncoder {
    pub encoder: MotionEncoder,
    dense: Vec<(Linear, BatchNorm)>,
    /// Convolutions after the last dense layer, whose output is reshaped to [channels, 34 frames].
    convs: Vec<(Conv1d, BatchNorm)>,
    last: Conv1d,
}

impl AutoEncoder {
    /// Adds the tensors of encoder and decoder to `params`.
    pub fn new(params: &mut Params, config: &Config) -> Result<Self> {
        let encoder = MotionEncoder::new(params, config)?;
        let dense = dense(params, DECODER, &[N_CODE, 128, LAST * WINDOW], SLOPE)?;
        let mut convs = Vec::new();
        for (i, (n_in, n_out)) in [(LAST, 64), (64, 64)].into_iter().enumerate() {
            let name = format!("{DECODER}conv{i}");
            convs.push((Conv1d::new(params, &name, n_in, n_out, 3)?, norm(params, &name, n_out, SLOPE)?));
        }
        let last = Conv1d::new(params, &format!("{DECODER}last"), 64, config.n_in, 3)?;
        Ok(Self { encoder, dense, convs, last })
    }

    /// Normalised windows [B, n_in, 34] to their reconstruction of the same shape.
    pub fn forward(&self, x: &Tensor, mode: &Mode) -> Result<Tensor> {
        let code = self.encoder.forward(x, mode)?;
        let y = through(&self.dense, &code, mode)?.reshape((x.dim(0)?, LAST, WINDOW))?;
        self.last.forward(&through(&self.convs, &y, mode)?)
    }

    /// Sets the weight of a batch in the running statistics.
    pub fn set_momentum(&mut self, momentum: f64) {
        self.encoder.set_momentum(momentum);
        self.dense.iter_mut().for_each(|(_, norm)| norm.set_momentum(momentum));
        self.convs.iter_mut().for_each(|(_, norm)| norm.set_momentum(momentum));
    }
}
