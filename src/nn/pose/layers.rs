//! Layers of a network that looks at pictures, and the operators that it is made of. A network's structure is written
//! once, over [`PictureOperators`]: run on tensors in training, written down as a file by an export.

use crate::nn::ops::batch_norm::BatchNorm;
use crate::nn::ops::conv_norm::conv_norm;
use crate::nn::ops::conv2d;
use crate::nn::ops::resize::twice;
use crate::nn::params::{Init, Params};
use candle_core::{DType, Result, Tensor};

const EPS: f64 = 1e-5;
/// Weight of a new batch in the running statistics, where nothing else is said.
const MOMENTUM: f64 = 0.1;

/// What a network of pictures is made of.
pub trait PictureOperators {
    /// Pictures of some size and number of channels.
    type Value;
    fn convolution(&mut self, layer: &ConvLayer, x: &Self::Value) -> Result<Self::Value>;
    /// Every pixel as two by two.
    fn twice(&mut self, x: &Self::Value) -> Result<Self::Value>;
    fn sum(&mut self, a: &Self::Value, b: &Self::Value) -> Result<Self::Value>;
}

/// Convolution with its weights, padding "same": followed by batch norm and ReLU, or with a bias alone.
pub struct ConvLayer {
    /// [O, C, K, K].
    weight: Tensor,
    /// [O].
    bias: Tensor,
    norm: Option<BatchNorm>,
    pub stride: usize,
}

/// Numbers of a layer whose batch norm is folded into its weights.
#[derive(Clone, Debug)]
pub struct FoldedConv {
    /// O, C, K, K.
    pub shape: Vec<usize>,
    pub weight: Vec<f32>,
    pub bias: Vec<f32>,
    pub has_relu: bool,
}

impl ConvLayer {
    /// Layer with batch norm and ReLU, weight [O, C, K, K].
    pub fn normed(params: &mut Params, name: &str, shape: [usize; 4], stride: usize) -> Result<Self> {
        let norm = BatchNorm::new(params, &format!("{name}.norm"), shape[0], EPS, MOMENTUM, 0.0)?;
        let weight = params.trainable(&format!("{name}.weight"), &shape, Init::He)?;
        // The norm takes a bias away again.
        let bias = Tensor::zeros(shape[0], weight.dtype(), params.device())?;
        Ok(Self { weight, bias, norm: Some(norm), stride })
    }

    /// Layer with a bias and nothing behind it.
    pub fn plain(params: &mut Params, name: &str, shape: [usize; 4]) -> Result<Self> {
        let weight = params.trainable(&format!("{name}.weight"), &shape, Init::Glorot)?;
        let bias = params.trainable(&format!("{name}.bias"), &shape[..1], Init::Constant(0.0))?;
        Ok(Self { weight, bias, norm: None, stride: 1 })
    }

    /// Changes the weight of a new batch in the running statistics.
    pub fn set_momentum(&mut self, momentum: f64) {
        self.norm.iter_mut().for_each(|norm| norm.set_momentum(momentum));
    }

    /// [B, H, W, C] to [B, ceil(H / stride), ceil(W / stride), O].
    pub fn forward(&self, x: &Tensor, train: bool) -> Result<Tensor> {
        let sizes = conv2d::same(x, &self.weight, self.stride)?;
        match &self.norm {
            Some(norm) => conv_norm(x, &self.weight, &self.bias, norm, sizes, train),
            None => conv2d::conv(x, &self.weight, &self.bias, sizes),
        }
    }

    /// One convolution that gives what the layer gives in evaluation, but for the ReLU.
    pub fn folded(&self) -> Result<FoldedConv> {
        let numbers = |tensor: &Tensor| tensor.to_dtype(DType::F32)?.flatten_all()?.to_vec1::<f32>();
        let (mut weight, mut bias) = (numbers(&self.weight)?, numbers(&self.bias)?);
        if let Some(norm) = &self.norm {
            let running = norm.running()?;
            let (gain, shift) = (numbers(&norm.weight)?, numbers(&norm.bias)?);
            let n = weight.len() / bias.len();
            for (o, weights) in weight.chunks_exact_mut(n).enumerate() {
                let scale = f64::from(gain[o]) / (running.variance[o] + norm.eps).sqrt();
                weights.iter_mut().for_each(|w| *w = (f64::from(*w) * scale) as f32);
                bias[o] = (f64::from(shift[o]) - running.mean[o] * scale) as f32;
            }
        }
        Ok(FoldedConv { shape: self.weight.dims().to_vec(), weight, bias, has_relu: self.norm.is_some() })
    }
}

/// The operators on tensors [B, H, W, C].
pub struct TensorOperators {
    /// Whether batch norm uses the batch's statistics.
    pub train: bool,
}

impl PictureOperators for TensorOperators {
    type Value = Tensor;

    fn convolution(&mut self, layer: &ConvLayer, x: &Tensor) -> Result<Tensor> {
        layer.forward(x, self.train)
    }

    fn twice(&mut self, x: &Tensor) -> Result<Tensor> {
        let (batch, height, width, channels) = x.dims4()?;
        let rows = twice(&x.reshape((batch, height, width * channels))?)?;
        let both = twice(&rows.reshape((batch * 2 * height, width, channels))?)?;
        both.reshape((batch, 2 * height, 2 * width, channels))
    }

    fn sum(&mut self, a: &Tensor, b: &Tensor) -> Result<Tensor> {
        a + b
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::ops::gradcheck::{pattern, worst};

    #[test]
    fn pixels_become_two_by_two_with_right_gradients() -> Result<()> {
        let x = pattern(&[2, 2, 3, 2], 0.0)?;
        let y = TensorOperators { train: false }.twice(&x)?;
        assert_eq!(y.dims(), [2, 4, 6, 2]);
        let at = |t: &Tensor, row: usize, column: usize| t.get(1)?.get(row)?.get(column)?.to_vec1::<f64>();
        for (row, column) in [(0, 0), (3, 5), (1, 2), (2, 3)] {
            assert_eq!(at(&y, row, column)?, at(&x, row / 2, column / 2)?);
        }
        assert!(worst(&[x], |v| TensorOperators { train: false }.twice(&v[0].sqr()?))? < 1e-7);
        Ok(())
    }

    #[test]
    fn a_folded_layer_is_the_layer() -> Result<()> {
        let mut params = Params::with_dtype(1, DType::F64);
        let layer = ConvLayer::normed(&mut params, "c", [3, 2, 3, 3], 2)?;
        let x = pattern(&[4, 5, 6, 2], 0.0)?;
        layer.forward(&x, true)?;
        let FoldedConv { shape, weight, bias, has_relu } = layer.folded()?;
        let weight = Tensor::from_vec(weight, shape, x.device())?.to_dtype(DType::F64)?;
        let bias = Tensor::new(bias, x.device())?.to_dtype(DType::F64)?;
        let y = conv2d::conv(&x, &weight, &bias, conv2d::same(&x, &weight, 2)?)?.relu()?;
        let off = (y - layer.forward(&x, false)?)?.abs()?.max_all()?.to_scalar::<f64>()?;
        assert!(has_relu && off < 1e-6, "{off}");
        Ok(())
    }
}
