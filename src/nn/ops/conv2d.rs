//! Convolution as an operator on tensors, channels last, with its weights: [B, T, C] over time and [B, T, F, C] over
//! time and frequency. The sums are computed in `direct_conv`; `conv_norm` includes a subsequent batch norm.

use super::operator::{CpuOperator, CustomOperator, Gradients, Operand};
use crate::cpu::axis::{ConvAxis, Padding};
use crate::cpu::direct_conv::{self, ConvSizes};
use crate::cpu::tensor::Scalar;
use crate::cpu::{channel_stats, weight_gradient};
use crate::gpu::launch::is_on_device;
use crate::gpu::layer::DeviceLayer;
use crate::gpu::passes;
use crate::params::{Init, Params};
use candle_core::{Result, Shape, Tensor};

/// Sizes of a convolution of `x` with `weight` [O, C, K] or [O, C, K, K'].
pub fn sizes(x: &Tensor, weight: &Tensor, stride: usize, padding: Padding) -> Result<ConvSizes> {
    let axis = |n, kernel| padding.axis(n, kernel, stride);
    let alone = ConvAxis::valid(1, 1, 1);
    let (batch, channels, axes) = match (x.dims(), weight.dims()) {
        ([b, t, c], [_, _, kernel]) => (*b, *c, [axis(*t, *kernel), alone]),
        ([b, t, f, c], [_, _, down, across]) => (*b, *c, [axis(*t, *down), axis(*f, *across)]),
        _ => candle_core::bail!("convolution: invalid ranks of input {:?} and weight {:?}", x.dims(), weight.dims()),
    };
    let (n_out, n_in) = (weight.dim(0)?, weight.dim(1)?);
    if n_in != channels || n_in * n_out * batch == 0 || axes.iter().any(|axis| axis.n_in * axis.n_out == 0) {
        candle_core::bail!("convolution: input {:?} (channels last) does not fit weight {:?}", x.dims(), weight.dims());
    }
    Ok(ConvSizes { batch, n_in, n_out, axes })
}

pub fn shape_out(s: &ConvSizes, rank: usize) -> Shape {
    let [rows, columns] = s.axes;
    match rank {
        3 => Shape::from((s.batch, rows.n_out, s.n_out)),
        _ => Shape::from((s.batch, rows.n_out, columns.n_out, s.n_out)),
    }
}

/// Computes the gradients of `x` and the weight from that of the output, each only if it is tracked.
pub fn gradients<T: Scalar>(s: &ConvSizes, x: &Operand<T>, weight: &Operand<T>, grad: &[T]) -> [Option<Vec<T>>; 2] {
    [
        x.tracked.then(|| direct_conv::gradient_of_input(s, weight.values, grad)),
        weight.tracked.then(|| weight_gradient::gradient_of_weight(s, x.values, grad)),
    ]
}

/// A convolution layer with padding "same": `<name>.weight` [O, C, K], Glorot uniform, and `<name>.bias` [O], zero.
#[derive(Clone)]
pub struct Conv {
    weight: Tensor,
    bias: Tensor,
    stride: usize,
}

impl Conv {
    pub fn new(params: &mut Params, name: &str, shape: &[usize], stride: usize) -> Result<Self> {
        let (weight, bias) = params.layer(name, shape, Init::Glorot, Init::Constant(0.0))?;
        Ok(Self { weight, bias, stride })
    }

    /// Maps [B, T, C] to [B, T', O].
    pub fn forward(&self, x: &Tensor) -> Result<Tensor> {
        if is_on_device(x) {
            return passes::channels_last(self.on_device(1.0), x, false);
        }
        conv(x, &self.weight, &self.bias, sizes(x, &self.weight, self.stride, Padding::Same)?)
    }

    /// Layer for a GPU, followed by a leaky ReLU with this slope.
    pub(crate) fn on_device(&self, slope: f64) -> DeviceLayer {
        let Self { weight, bias, stride } = self.clone();
        DeviceLayer { weight, bias, norm: None, stride, padding: Padding::Same, slope }
    }
}

pub fn conv(x: &Tensor, weight: &Tensor, bias: &Tensor, sizes: ConvSizes) -> Result<Tensor> {
    x.contiguous()?.apply_op3(weight, bias, CustomOperator(ConvOp { sizes }))
}

struct ConvOp {
    sizes: ConvSizes,
}

impl CpuOperator for ConvOp {
    const NAME: &'static str = "convolution, channels last";

    fn forward<T: Scalar>(&self, [x, weight, bias]: [Operand<T>; 3]) -> Result<(Vec<T>, Shape)> {
        let y = direct_conv::forward(&self.sizes, x.values, weight.values, bias.values, |_, _| {});
        Ok((y, shape_out(&self.sizes, x.dims.len())))
    }

    fn backward<T: Scalar>(&self, [x, weight, _]: [Operand<T>; 3], _: &[T], grad: &[T]) -> Gradients<T> {
        let [of_x, of_weight] = gradients(&self.sizes, &x, &weight, grad);
        let of_bias = channel_stats::sums(grad, self.sizes.n_out).into_iter().map(T::from_f64).collect();
        Ok([of_x, of_weight, Some(of_bias)])
    }
}
