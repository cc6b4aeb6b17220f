//! Convolution, batch norm and leaky ReLU as one operator, channels last: the statistics are summed while an output
//! lies in the cache, evaluation writes the result at once, and the way back overwrites what was kept for it. Of a
//! layer in training two numbers a place are kept: before the norm, and the result.

use super::batch_norm::{BatchNorm, Statistics};
use super::conv2d;
use super::fallback;
use crate::nn::cpu::channel_stats::{ChannelMoments, Norm};
use crate::nn::cpu::direct_conv;
use crate::nn::cpu::direct_conv::ConvSizes;
use crate::nn::cpu::tensor::{Scalar, is_f64, read, slice};
use candle_core::backend::BackendStorage;
use candle_core::{CpuStorage, CustomOp3, Layout, Result, Shape, Tensor};
use std::sync::{Arc, Mutex, OnceLock};

/// `x` [B, T, C] or [B, T, F, C] through the convolution of these sizes, then `norm` with its activation. Training uses
/// the batch's statistics and moves the running ones.
pub fn conv_norm(
    x: &Tensor,
    weight: &Tensor,
    bias: &Tensor,
    norm: &BatchNorm,
    sizes: ConvSizes,
    train: bool,
) -> Result<Tensor> {
    if crate::nn::device::needs_fallback(x) {
        return fallback_conv_norm(x, weight, bias, norm, &sizes, train);
    }
    let x = x.contiguous()?;
    let channels = Tensor::cat(&[bias, &norm.weight, &norm.bias], 0)?;
    let statistics = Arc::new(OnceLock::new());
    if !train {
        let _ = statistics.set(norm.running()?);
    }
    let keeps = [&x, weight, &channels].iter().any(|tensor| tensor.track_op());
    let kept = keeps.then(|| Mutex::new(None));
    let op = ConvNormOp { sizes, eps: norm.eps, slope: norm.slope, train, statistics: statistics.clone(), kept };
    let y = x.apply_op3(weight, &channels, op)?;
    if let (true, Some(batch)) = (train, statistics.get()) {
        norm.follow(batch, y.elem_count() / sizes.n_out)?;
    }
    Ok(y)
}

/// Operator of [`conv_norm`]; the third input holds bias, norm's weight and norm's bias, one after the other.
struct ConvNormOp {
    sizes: ConvSizes,
    eps: f64,
    slope: f64,
    train: bool,
    /// Set by the forward pass when training, before it when evaluating.
    statistics: Arc<OnceLock<Statistics>>,
    /// For the way back, if there is one: the values before the norm.
    kept: Option<Mutex<Option<CpuStorage>>>,
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

    /// The result and, where there is a way back, what was before the norm.
    fn forward<T: Scalar>(&self, x: &[T], weight: &[T], channels: &[T]) -> (Vec<T>, Option<Vec<T>>) {
        let (s, bias) = (&self.sizes, &channels[..self.sizes.n_out]);
        if let (None, Some(statistics)) = (&self.kept, self.statistics.get()) {
            let norm = self.norm(channels, statistics);
            return (direct_conv::forward(s, x, weight, bias, |_, piece| norm.apply(piece)), None);
        }
        let moments: Vec<OnceLock<ChannelMoments>> = (0..direct_conv::n_pieces(s)).map(|_| OnceLock::new()).collect();
        let mut z = direct_conv::forward(s, x, weight, bias, |piece, values| {
            if self.train {
                let _ = moments[piece].set(ChannelMoments::measure(values, s.n_out));
            }
        });
        let statistics = self.statistics.get_or_init(|| {
            let all = moments.iter().filter_map(OnceLock::get).fold(ChannelMoments::default(), |all, one| all.and(one));
            Statistics { variance: all.squares.iter().map(|v| v / all.n).collect(), mean: all.mean }
        });
        let norm = self.norm(channels, statistics);
        if self.kept.is_none() {
            norm.apply_parallel(&mut z);
            return (z, None);
        }
        (norm.forward(&z), Some(z))
    }

    /// Overwrites `z` with its gradient; gives those of bias, norm's weight and norm's bias.
    fn backward<T: Scalar>(&self, z: &mut [T], channels: &[T], statistics: &Statistics, grad: &[T]) -> Vec<T> {
        let norm = self.norm(channels, statistics);
        let (plain, product) = norm.sums_of_gradient(z, grad);
        let n = (z.len() / self.sizes.n_out) as f64;
        let inverse: Vec<f64> = statistics.variance.iter().map(|v| 1.0 / (v + self.eps).sqrt()).collect();
        // The batch's own mean and variance move with z; fixed ones do not.
        let moving = |scale: &T| if self.train { scale.to_f64() / n } else { 0.0 };
        let constant: Vec<T> = norm.scale.iter().zip(&plain).map(|(s, sum)| T::from_f64(-moving(s) * sum)).collect();
        let linear = norm.scale.iter().zip(&product).zip(&inverse);
        let linear: Vec<T> = linear.map(|((s, sum), inv)| T::from_f64(-moving(s) * sum * inv * inv)).collect();
        norm.backward(z, grad, &constant, &linear);
        // A batch's own mean takes a bias away again: its gradient is zero then.
        let of_bias = |(s, sum): (&T, &f64)| if self.train { T::zero() } else { T::from_f64(s.to_f64() * sum) };
        let of_bias: Vec<T> = norm.scale.iter().zip(&plain).map(of_bias).collect();
        let of_weight = product.iter().zip(&inverse).map(|(sum, inverse)| T::from_f64(sum * inverse));
        of_bias.into_iter().chain(of_weight).chain(plain.iter().map(|v| T::from_f64(*v))).collect()
    }
}

impl CustomOp3 for ConvNormOp {
    fn name(&self) -> &'static str {
        "convolution, batch norm and leaky ReLU"
    }

    fn cpu_fwd(
        &self,
        x: &CpuStorage,
        lx: &Layout,
        w: &CpuStorage,
        lw: &Layout,
        c: &CpuStorage,
        lc: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let (y, z) = if is_f64(x.dtype())? {
            let (y, z) = self.forward::<f64>(slice(x, lx)?, slice(w, lw)?, slice(c, lc)?);
            (CpuStorage::F64(y), z.map(CpuStorage::F64))
        } else {
            let (y, z) = self.forward::<f32>(slice(x, lx)?, slice(w, lw)?, slice(c, lc)?);
            (CpuStorage::F32(y), z.map(CpuStorage::F32))
        };
        if let Some(Ok(mut kept)) = self.kept.as_ref().map(Mutex::lock) {
            *kept = z;
        }
        Ok((y, conv2d::shape_out(&self.sizes, lx.dims().len())))
    }

    fn bwd(
        &self,
        x: &Tensor,
        weight: &Tensor,
        channels: &Tensor,
        _y: &Tensor,
        grad: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>, Option<Tensor>)> {
        fn typed<T: Scalar>(
            op: &ConvNormOp,
            (x, weight, channels): (&Tensor, &Tensor, &Tensor),
            mut z: Vec<T>,
            statistics: &Statistics,
            grad: &Tensor,
        ) -> Result<(Option<Tensor>, Option<Tensor>, Option<Tensor>)> {
            let of_channels = read::<T, _>(channels, |channels| {
                read::<T, _>(grad, |grad| Ok(op.backward(&mut z, channels, statistics, grad)))
            })?;
            let [of_x, of_weight] = conv2d::gradients(&op.sizes, x, weight, &z)?;
            Ok((of_x, of_weight, Some(Tensor::from_vec(of_channels, channels.shape(), channels.device())?)))
        }
        let kept = self.kept.as_ref().and_then(|kept| kept.lock().ok()?.take());
        let inputs = (x, weight, channels);
        match (kept, self.statistics.get()) {
            (Some(CpuStorage::F32(z)), Some(statistics)) => typed(self, inputs, z, statistics, grad),
            (Some(CpuStorage::F64(z)), Some(statistics)) => typed(self, inputs, z, statistics, grad),
            _ => candle_core::bail!("a layer's way back can be gone once only"),
        }
    }
}

/// What [`conv_norm`] gives, on devices without the kernels.
pub fn fallback_conv_norm(
    x: &Tensor,
    weight: &Tensor,
    bias: &Tensor,
    norm: &BatchNorm,
    s: &ConvSizes,
    train: bool,
) -> Result<Tensor> {
    fallback::last(&norm.forward_fallback(&fallback::conv_first(x, weight, bias, s)?, train)?, x.rank())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::ops::gradcheck::{pattern, worst};
    use crate::nn::params::Params;

    #[test]
    fn gradients_are_right() -> Result<()> {
        for (train, slope) in [(true, 0.2), (true, 1.0), (false, 0.2)] {
            let inputs = [
                pattern(&[2, 7, 6, 3], 0.0)?,
                pattern(&[5, 3, 4, 4], 1.0)?,
                Tensor::cat(&[pattern(&[5], 2.0)?, (pattern(&[5], 5.0)? + 1.5)?, pattern(&[5], 9.0)?], 0)?,
            ];
            let sizes = conv2d::same(&inputs[0], &inputs[1], 2)?;
            let fixed = Statistics { mean: vec![0.2, -0.3, 0.1, 0.0, 0.4], variance: vec![0.5, 1.5, 2.0, 1.0, 0.7] };
            let error = worst(&inputs, |v| {
                let statistics = Arc::new(OnceLock::new());
                if !train {
                    let _ = statistics.set(fixed.clone());
                }
                let op = ConvNormOp { sizes, eps: 1e-3, slope, train, statistics, kept: Some(Mutex::new(None)) };
                v[0].apply_op3(&v[1], &v[2], op)
            })?;
            assert!(error < 1e-7, "train {train}, slope {slope}: {error}");
        }
        Ok(())
    }

    #[test]
    fn it_is_the_convolution_and_the_norm_after_each_other() -> anyhow::Result<()> {
        let mut params = Params::with_dtype(0, candle_core::DType::F64);
        let norm = BatchNorm::new(&mut params, "n", 6, 1e-3, 0.3, 0.2)?;
        let (x, weight) = (pattern(&[3, 5, 4], 0.0)?, pattern(&[6, 4, 3], 1.0)?);
        let bias = pattern(&[6], 2.0)?;
        let sizes = conv2d::same(&x, &weight, 1)?;
        let zeros = Tensor::zeros(6, candle_core::DType::F64, x.device())?;
        for train in [true, false, true, false] {
            let before = params.tensors()?;
            let fused = conv_norm(&x, &weight, &bias, &norm, sizes, train)?;
            let after = params.tensors()?;
            params.load(&before)?;
            // A convolution alone, as one with a norm that changes nothing.
            let mut plain = Params::with_dtype(0, candle_core::DType::F64);
            let nothing = BatchNorm::new(&mut plain, "n", 6, 0.0, 0.3, 1.0)?;
            let z = conv_norm(&x, &weight, &zeros, &nothing, sizes, false)?;
            let z = z.broadcast_add(&bias)?.transpose(1, 2)?;
            let apart = norm.forward(&z, train)?.transpose(1, 2)?;
            assert!((fused - apart)?.abs()?.max_all()?.to_scalar::<f64>()? < 1e-12);
            for (name, tensor) in params.tensors()? {
                assert!((tensor - &after[&name])?.abs()?.max_all()?.to_scalar::<f64>()? < 1e-12, "{name}");
            }
        }
        Ok(())
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() -> anyhow::Result<()> {
        let f32s = |shape: &[usize], phase| pattern(shape, phase)?.to_dtype(candle_core::DType::F32);
        let (x, bias) = (f32s(&[3, 40, 10, 20], 0.0)?, f32s(&[70], 5.0)?);
        let weight = candle_core::Var::from_tensor(&f32s(&[70, 20, 3, 3], 1.0)?)?;
        let sizes = conv2d::same(&x, &weight, 1)?;
        let run = |n_threads| -> anyhow::Result<Vec<Vec<f32>>> {
            let norm = BatchNorm::new(&mut Params::new(0), "n", 70, 1e-3, 0.3, 0.2)?;
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build()?;
            pool.install(|| {
                let y = conv_norm(&x, &weight, &bias, &norm, sizes, true)?;
                let gradients = y.sqr()?.sum_all()?.backward()?;
                let gradient = gradients.get(&weight).ok_or_else(|| candle_core::Error::msg("no gradient"))?;
                Ok(vec![y.flatten_all()?.to_vec1()?, gradient.flatten_all()?.to_vec1()?])
            })
        };
        assert_eq!(run(1)?, run(3)?);
        Ok(())
    }
}
