//! Batch normalisation followed by leaky ReLU as one operator, forward and backward, with a third of the memory passes
//! of two operators. Training uses the batch's statistics and updates the running ones; evaluation uses these.

use super::operator::{CpuOperator, CustomOperator, Gradients, Operand};
use crate::cpu::tensor::{GRAIN, LANES, Scalar, sum};
use crate::cpu::vectorised::{DropMask, drop_out};
use crate::params::{Init, Params};
use candle_core::{Device, Result, Shape, Tensor, Var};
use rayon::prelude::*;
use std::sync::{Arc, OnceLock};

#[derive(Clone, Debug, PartialEq)]
pub struct Statistics {
    pub mean: Vec<f64>,
    pub variance: Vec<f64>,
}

/// Batch norm layer. Tensors with their initial values: `<name>.weight` (1), `<name>.bias` (0), `<name>.running_mean`
/// (0) and `<name>.running_var` (1), each [C].
#[derive(Clone)]
pub struct BatchNorm {
    pub(crate) weight: Tensor,
    pub(crate) bias: Tensor,
    pub(crate) running_mean: Var,
    pub(crate) running_var: Var,
    pub(crate) eps: f64,
    pub(crate) momentum: f64,
    pub(crate) slope: f64,
}

impl BatchNorm {
    /// Creates a layer. `momentum` is the weight of a new batch in the running statistics (PyTorch's convention:
    /// TensorFlow's 0.99 is 0.01 here). `slope` is the factor of negative results; 1 for no activation, 0 for ReLU.
    pub fn new(params: &mut Params, name: &str, n: usize, eps: f64, momentum: f64, slope: f64) -> Result<Self> {
        let (weight, bias) = params.layer(name, &[n], Init::Constant(1.0), Init::Constant(0.0))?;
        let running_mean = params.buffer(&format!("{name}.running_mean"), &[n], 0.0)?;
        let running_var = params.buffer(&format!("{name}.running_var"), &[n], 1.0)?;
        Ok(Self { weight, bias, running_mean, running_var, eps, momentum, slope })
    }

    /// Sets the weight of a new batch in the running statistics.
    pub fn set_momentum(&mut self, momentum: f64) {
        self.momentum = momentum;
    }

    /// Maps [B, C, ...] to the same shape. Training updates the running statistics.
    pub fn forward(&self, x: &Tensor, train: bool) -> Result<Tensor> {
        self.forward_dropped(x, train, None)
    }

    /// [`Self::forward`] with dropout after ReLU (slope 0); backward, dropped values are like those zeroed by the ReLU.
    pub fn forward_dropped(&self, x: &Tensor, train: bool, dropout: Option<DropMask>) -> Result<Tensor> {
        if dropout.is_some() && self.slope != 0.0 {
            candle_core::bail!("batch norm: dropout requires a ReLU (slope 0), found slope {}", self.slope);
        }
        let statistics = Arc::new(OnceLock::new());
        if !train {
            let _ = statistics.set(self.running()?);
        }
        let op = BatchNormOp { statistics: statistics.clone(), eps: self.eps, slope: self.slope, train, dropout };
        let y = x.contiguous()?.apply_op3(&self.weight, &self.bias, CustomOperator(op))?;
        if let (true, Some(batch)) = (train, statistics.get()) {
            self.update_running(batch, x.elem_count() / batch.mean.len())?;
        }
        Ok(y)
    }

    pub fn running(&self) -> Result<Statistics> {
        let values = |var: &Var| var.to_dtype(candle_core::DType::F64)?.to_vec1();
        Ok(Statistics { mean: values(&self.running_mean)?, variance: values(&self.running_var)? })
    }

    /// Updates the running statistics with those of a batch of `n` values per channel, using the unbiased variance.
    pub fn update_running(&self, batch: &Statistics, n: usize) -> Result<()> {
        let n = n as f64;
        let update = |running: &Var, batch: &[f64], scale: f64| {
            let batch = Tensor::new(batch, &Device::Cpu)?.to_dtype(running.dtype())?;
            running
                .set(&((running.as_detached_tensor() * (1.0 - self.momentum))? + (batch * (self.momentum * scale))?)?)
        };
        update(&self.running_mean, &batch.mean, 1.0)?;
        update(&self.running_var, &batch.variance, n / (n - 1.0).max(1.0))
    }
}

/// The operator of the layer, of input, weight and bias.
pub struct BatchNormOp {
    /// Set by the forward pass in training, before it in evaluation.
    pub statistics: Arc<OnceLock<Statistics>>,
    /// Added to the variance.
    pub eps: f64,
    /// Of the leaky ReLU that follows; 1 for none.
    pub slope: f64,
    pub train: bool,
    /// Only after a ReLU.
    pub dropout: Option<DropMask>,
}

impl BatchNormOp {
    /// Factor of the values that are not dropped.
    fn retained_scale(&self) -> f64 {
        self.dropout.map_or(1.0, |mask| mask.scale)
    }
}

/// Batch size, number of channels, and number of values per channel and sample.
type NormSizes = (usize, usize, usize);

fn sizes(dims: &[usize], n_weights: usize) -> Result<NormSizes> {
    match dims {
        [batch, channels, rest @ ..] if *channels == n_weights && dims.iter().all(|d| *d > 0) => {
            Ok((*batch, *channels, rest.iter().product()))
        }
        _ => candle_core::bail!("batch norm: input {dims:?} does not fit {n_weights} channels"),
    }
}

/// Iterates over the rows [b, c] of channel `c`, for all b.
fn rows<T>(x: &[T], c: usize, (_, channels, len): NormSizes) -> impl Iterator<Item = &[T]> {
    x.chunks_exact(len).skip(c).step_by(channels)
}

fn measure<T: Scalar>(x: &[T], s: NormSizes) -> Statistics {
    let n = (s.0 * s.2) as f64;
    let per_channel = |c: usize| {
        let mean = rows(x, c, s).map(sum).sum::<f64>() / n;
        (mean, rows(x, c, s).map(|row| sum_of_squares(row, T::from_f64(mean))).sum::<f64>() / n)
    };
    let (mean, variance) = (0..s.1).into_par_iter().with_min_len(GRAIN / (s.0 * s.2)).map(per_channel).unzip();
    Statistics { mean, variance }
}

/// Sums `(x - centre)^2` in a fixed order.
fn sum_of_squares<T: Scalar>(x: &[T], centre: T) -> f64 {
    let (chunks, rest) = x.as_chunks::<LANES>();
    let mut lanes = [T::zero(); LANES];
    let add = |lane: &mut T, x: &T| *lane += (*x - centre) * (*x - centre);
    chunks.iter().for_each(|x| lanes.iter_mut().zip(x).for_each(|(lane, x)| add(lane, x)));
    lanes.iter_mut().zip(rest).for_each(|(lane, x)| add(lane, x));
    lanes.iter().map(|lane| lane.to_f64()).sum()
}

/// Sums `grad` and `grad * (x - centre)` in a fixed order, after backpropagating `grad` through the activation with
/// the output `y`.
fn sums_of_gradient<T: Scalar>(x: &[T], y: &[T], grad: &[T], centre: T, slope: T) -> (f64, f64) {
    let (xs, ys, grads) = (x.as_chunks::<LANES>(), y.as_chunks::<LANES>(), grad.as_chunks::<LANES>());
    let (mut plain, mut product) = ([T::zero(); LANES], [T::zero(); LANES]);
    let mut add = |x: &[T], y: &[T], grad: &[T]| {
        let lanes = plain.iter_mut().zip(&mut product);
        for ((lanes, x), (y, grad)) in lanes.zip(x).zip(y.iter().zip(grad)) {
            let grad = before_activation(*y, *grad, slope);
            *lanes.0 += grad;
            *lanes.1 += grad * (*x - centre);
        }
    };
    xs.0.iter().zip(ys.0).zip(grads.0).for_each(|((x, y), grad)| add(x, y, grad));
    add(xs.1, ys.1, grads.1);
    let total = |lanes: [T; LANES]| lanes.iter().map(|lane| lane.to_f64()).sum();
    (total(plain), total(product))
}

/// Gradient before the leaky ReLU with the output `y`.
fn before_activation<T: Scalar>(y: T, grad: T, slope: T) -> T {
    if y > T::zero() { grad } else { grad * slope }
}

impl CpuOperator for BatchNormOp {
    const NAME: &'static str = "batch norm and leaky ReLU";

    fn forward<T: Scalar>(&self, [x, weight, bias]: [Operand<T>; 3]) -> Result<(Vec<T>, Shape)> {
        let s = sizes(x.dims, weight.values.len())?;
        let statistics = self.statistics.get_or_init(|| measure(x.values, s));
        let (zero, slope) = (T::zero(), T::from_f64(self.slope));
        let mut y = vec![zero; x.values.len()];
        let rows = y.par_chunks_mut(s.2).zip(x.values.par_chunks(s.2));
        rows.with_min_len(GRAIN / s.2).enumerate().for_each(|(row, (y, x))| {
            let c = row % s.1;
            let scale = weight.values[c].to_f64() / (statistics.variance[c] + self.eps).sqrt();
            let shift = T::from_f64(bias.values[c].to_f64() - statistics.mean[c] * scale);
            let scale = T::from_f64(scale);
            for (y, x) in y.iter_mut().zip(x) {
                let z = *x * scale + shift;
                *y = if z > zero { z } else { z * slope };
            }
            if let Some(mask) = self.dropout {
                drop_out(y, row * s.2, mask);
            }
        });
        Ok((y, Shape::from(x.dims)))
    }

    fn backward<T: Scalar>(&self, [x, weight, _]: [Operand<T>; 3], y: &[T], grad: &[T]) -> Gradients<T> {
        let s = sizes(x.dims, weight.values.len())?;
        let x = x.values;
        let statistics = self.statistics.get_or_init(|| measure(x, s));
        let slope = T::from_f64(self.slope);
        let per_channel = |c: usize| {
            let centre = T::from_f64(statistics.mean[c]);
            let (mut of_bias, mut of_product) = (0.0, 0.0);
            for ((x, y), grad) in rows(x, c, s).zip(rows(y, c, s)).zip(rows(grad, c, s)) {
                let (plain, product) = sums_of_gradient(x, y, grad, centre, slope);
                of_bias += plain;
                of_product += product;
            }
            let inverse = 1.0 / (statistics.variance[c] + self.eps).sqrt();
            (T::from_f64(of_product * inverse * self.retained_scale()), T::from_f64(of_bias * self.retained_scale()))
        };
        let (grad_weight, grad_bias): (Vec<T>, Vec<T>) =
            (0..s.1).into_par_iter().with_min_len(GRAIN / (s.0 * s.2)).map(per_channel).unzip();
        let n = (s.0 * s.2) as f64;
        let mut grad_x = vec![T::zero(); x.len()];
        let inputs = x.par_chunks(s.2).zip(y.par_chunks(s.2)).zip(grad.par_chunks(s.2));
        grad_x.par_chunks_mut(s.2).zip(inputs).with_min_len(GRAIN / s.2).enumerate().for_each(
            |(row, (out, ((x, y), grad)))| {
                let c = row % s.1;
                let inverse = 1.0 / (statistics.variance[c] + self.eps).sqrt();
                let scale = weight.values[c].to_f64() * inverse;
                // The batch's own mean and variance depend on x; the running ones do not.
                let moving = if self.train { scale / n } else { 0.0 };
                let (scale, constant) =
                    (T::from_f64(scale * self.retained_scale()), T::from_f64(-moving * grad_bias[c].to_f64()));
                let linear = T::from_f64(-moving * grad_weight[c].to_f64() * inverse);
                let centre = T::from_f64(statistics.mean[c]);
                for (((out, x), y), grad) in out.iter_mut().zip(x).zip(y).zip(grad) {
                    *out = scale * before_activation(*y, *grad, slope) + constant + linear * (*x - centre);
                }
            },
        );
        Ok([Some(grad_x), Some(grad_weight), Some(grad_bias)])
    }
}
