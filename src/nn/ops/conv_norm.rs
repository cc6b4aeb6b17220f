//! Convolution, batch norm and leaky ReLU as one operator, channels last: statistics are summed while the output is in
//! the cache, evaluation writes the final result directly, and the backward pass overwrites the saved values. Training
//! stores two values per position: the input of the norm, and the result.

use super::batch_norm::{BatchNorm, Statistics};
use super::conv2d;
use super::operator::{CpuOperator, CustomOperator, Gradients, Operand};
use crate::cpu::channel_stats::{ChannelMoments, Norm};
use crate::cpu::direct_conv::{self, ConvSizes};
use crate::cpu::tensor::Scalar;
use candle_core::{CpuStorage, Result, Shape, Tensor};
use std::sync::{Arc, Mutex, OnceLock};

/// Applies the convolution of these sizes to `x` [B, T, C] or [B, T, F, C], then `norm` with its activation. Training
/// uses the batch's statistics and updates the running ones.
pub fn conv_norm(
    x: &Tensor,
    weight: &Tensor,
    bias: &Tensor,
    norm: &BatchNorm,
    sizes: ConvSizes,
    train: bool,
) -> Result<Tensor> {
    let x = x.contiguous()?;
    let channels = Tensor::cat(&[bias, &norm.weight, &norm.bias], 0)?;
    let statistics = Arc::new(OnceLock::new());
    if !train {
        let _ = statistics.set(norm.running()?);
    }
    let saves = [&x, weight, &channels].iter().any(|tensor| tensor.track_op());
    let saved_input = saves.then(|| Mutex::new(None));
    let op = ConvNormOp { sizes, eps: norm.eps, slope: norm.slope, train, statistics: statistics.clone(), saved_input };
    let y = x.apply_op3(weight, &channels, CustomOperator(op))?;
    if let (true, Some(batch)) = (train, statistics.get()) {
        norm.update_running(batch, y.elem_count() / sizes.n_out)?;
    }
    Ok(y)
}

/// Operator of [`conv_norm`]; its third input is the concatenation of bias, norm weight and norm bias.
struct ConvNormOp {
    sizes: ConvSizes,
    eps: f64,
    slope: f64,
    train: bool,
    /// Set by the forward pass in training, before it in evaluation.
    statistics: Arc<OnceLock<Statistics>>,
    /// Input of the norm, saved for the backward pass if there is one.
    saved_input: Option<Mutex<Option<CpuStorage>>>,
}

impl ConvNormOp {
    fn norm<T: Scalar>(&self, channels: &[T], statistics: &Statistics) -> Norm<T> {
        let (weight, bias) = channels[self.sizes.n_out..].split_at(self.sizes.n_out);
        let scale = |(weight, variance): (&T, &f64)| weight.to_f64() / (variance + self.eps).sqrt();
        let scale: Vec<f64> = weight.iter().zip(&statistics.variance).map(scale).collect();
        let shift = bias.iter().zip(&statistics.mean).zip(&scale);
        Norm {
            mean: statistics.mean.iter().map(|v| T::from_f64(*v)).collect(),
            shift: shift.map(|((bias, mean), scale)| T::from_f64(bias.to_f64() - mean * scale)).collect(),
            scale: scale.into_iter().map(T::from_f64).collect(),
            slope: T::from_f64(self.slope),
        }
    }

    /// Returns the result and, if there will be a backward pass, the input of the norm.
    fn normalised<T: Scalar>(&self, x: &[T], weight: &[T], channels: &[T]) -> (Vec<T>, Option<Vec<T>>) {
        let (s, bias) = (&self.sizes, &channels[..self.sizes.n_out]);
        if let (None, Some(statistics)) = (&self.saved_input, self.statistics.get()) {
            let norm = self.norm(channels, statistics);
            return (direct_conv::forward(s, x, weight, bias, |_, chunk| norm.apply(chunk)), None);
        }
        let moments: Vec<OnceLock<ChannelMoments>> = (0..direct_conv::n_chunks(s)).map(|_| OnceLock::new()).collect();
        let mut z = direct_conv::forward(s, x, weight, bias, |chunk, values| {
            if self.train {
                let _ = moments[chunk].set(ChannelMoments::measure(values, s.n_out));
            }
        });
        let statistics = self.statistics.get_or_init(|| {
            let all = moments.iter().filter_map(OnceLock::get).fold(ChannelMoments::default(), |all, one| all.and(one));
            Statistics { variance: all.squares.iter().map(|v| v / all.n).collect(), mean: all.mean }
        });
        let norm = self.norm(channels, statistics);
        if self.saved_input.is_none() {
            norm.apply_parallel(&mut z);
            return (z, None);
        }
        (norm.forward(&z), Some(z))
    }

    /// Overwrites `z` with its gradient; returns the gradients of bias, norm weight and norm bias, concatenated.
    fn overwrite<T: Scalar>(&self, z: &mut [T], channels: &[T], statistics: &Statistics, grad: &[T]) -> Vec<T> {
        let norm = self.norm(channels, statistics);
        let (plain, product) = norm.sums_of_gradient(z, grad);
        let n = (z.len() / self.sizes.n_out) as f64;
        let inverse: Vec<f64> = statistics.variance.iter().map(|v| 1.0 / (v + self.eps).sqrt()).collect();
        // The batch's own mean and variance depend on z; the running ones do not.
        let moving = |scale: &T| if self.train { scale.to_f64() / n } else { 0.0 };
        let constant: Vec<T> = norm.scale.iter().zip(&plain).map(|(s, sum)| T::from_f64(-moving(s) * sum)).collect();
        let linear = norm.scale.iter().zip(&product).zip(&inverse);
        let linear: Vec<T> = linear.map(|((s, sum), inv)| T::from_f64(-moving(s) * sum * inv * inv)).collect();
        norm.backward(z, grad, &constant, &linear);
        // Subtracting the batch's own mean cancels the bias, so its gradient is zero.
        let of_bias = |(s, sum): (&T, &f64)| if self.train { T::zero() } else { T::from_f64(s.to_f64() * sum) };
        let of_bias: Vec<T> = norm.scale.iter().zip(&plain).map(of_bias).collect();
        let of_weight = product.iter().zip(&inverse).map(|(sum, inverse)| T::from_f64(sum * inverse));
        of_bias.into_iter().chain(of_weight).chain(plain.iter().map(|v| T::from_f64(*v))).collect()
    }
}

impl CpuOperator for ConvNormOp {
    const NAME: &'static str = "convolution, batch norm and leaky ReLU";

    fn forward<T: Scalar>(&self, [x, weight, channels]: [Operand<T>; 3]) -> Result<(Vec<T>, Shape)> {
        let (y, z) = self.normalised(x.values, weight.values, channels.values);
        if let Some(Ok(mut saved_input)) = self.saved_input.as_ref().map(Mutex::lock) {
            *saved_input = z.map(T::to_cpu_storage_owned);
        }
        Ok((y, conv2d::shape_out(&self.sizes, x.dims.len())))
    }

    fn backward<T: Scalar>(&self, [x, weight, channels]: [Operand<T>; 3], _: &[T], grad: &[T]) -> Gradients<T> {
        let saved_input = self.saved_input.as_ref().and_then(|saved_input| saved_input.lock().ok()?.take());
        let (Some(z), Some(statistics)) = (saved_input, self.statistics.get()) else {
            candle_core::bail!("conv_norm: backward was called twice for one forward pass");
        };
        let mut z = T::cpu_storage_data(z)?;
        let of_channels = self.overwrite(&mut z, channels.values, statistics, grad);
        let [of_x, of_weight] = conv2d::gradients(&self.sizes, &x, &weight, &z);
        Ok([of_x, of_weight, Some(of_channels)])
    }
}
