//! Convolution as an operator on tensors, channels last, with its weights: [B, T, C] over time and [B, T, F, C] over
//! time and frequency. The sums are in `conv`; where a batch norm follows, `conv_norm` does both at once.

use super::fallback;
use crate::nn::cpu::axis::ConvAxis;
use crate::nn::cpu::channel_stats;
use crate::nn::cpu::direct_conv;
use crate::nn::cpu::direct_conv::ConvSizes;
use crate::nn::cpu::tensor::{Scalar, is_f64, read, slice};
use crate::nn::cpu::weight_gradient;
use crate::nn::params::{Init, Params};
use candle_core::backend::BackendStorage;
use candle_core::{CpuStorage, CustomOp3, Layout, Result, Shape, Tensor};

/// The sizes of a convolution of `x` with `weight` [O, C, K] or [O, C, K, K'], padding "same".
pub fn same(x: &Tensor, weight: &Tensor, stride: usize) -> Result<ConvSizes> {
    sizes(x, weight, |n, kernel| ConvAxis::same(n, kernel, stride))
}

/// Sizes of a convolution without padding, stride 1.
pub fn valid(x: &Tensor, weight: &Tensor) -> Result<ConvSizes> {
    sizes(x, weight, ConvAxis::valid)
}

fn sizes(x: &Tensor, weight: &Tensor, axis: impl Fn(usize, usize) -> ConvAxis) -> Result<ConvSizes> {
    let alone = ConvAxis::valid(1, 1);
    let (batch, channels, axes) = match (x.dims(), weight.dims()) {
        ([b, t, c], [_, _, kernel]) => (*b, *c, [axis(*t, *kernel), alone]),
        ([b, t, f, c], [_, _, down, across]) => (*b, *c, [axis(*t, *down), axis(*f, *across)]),
        _ => candle_core::bail!("convolution of {:?} with {:?}: a rank is wrong", x.dims(), weight.dims()),
    };
    let (n_out, n_in) = (weight.dim(0)?, weight.dim(1)?);
    if n_in != channels || n_in * n_out * batch == 0 || axes.iter().any(|axis| axis.n_in * axis.n_out == 0) {
        candle_core::bail!("convolution: input {:?} (channels last) does not fit weight {:?}", x.dims(), weight.dims());
    }
    Ok(ConvSizes { batch, n_in, n_out, axes })
}

/// The shape of the result of a convolution of an input of this rank.
pub fn shape_out(s: &ConvSizes, rank: usize) -> Shape {
    let [rows, columns] = s.axes;
    match rank {
        3 => Shape::from((s.batch, rows.n_out, s.n_out)),
        _ => Shape::from((s.batch, rows.n_out, columns.n_out, s.n_out)),
    }
}

/// Gradients of `x` and the weight from that of the result, each where it is wanted.
pub fn gradients<T: Scalar>(s: &ConvSizes, x: &Tensor, weight: &Tensor, grad: &[T]) -> Result<[Option<Tensor>; 2]> {
    let of_x =
        x.track_op().then(|| read::<T, _>(weight, |w| Ok(direct_conv::gradient_of_input(s, w, grad)))).transpose()?;
    let of_weight = weight
        .track_op()
        .then(|| read::<T, _>(x, |x| Ok(weight_gradient::gradient_of_weight(s, x, grad))))
        .transpose()?;
    let tensor = |values: Option<Vec<T>>, like: &Tensor| {
        values.map(|values| Tensor::from_vec(values, like.shape(), like.device())).transpose()
    };
    Ok([tensor(of_x, x)?, tensor(of_weight, weight)?])
}

/// A convolution with its weights: `<name>.weight` [O, C, K], Glorot uniform, and `<name>.bias` [O], zero; padding
/// "same".
pub struct Conv {
    weight: Tensor,
    bias: Tensor,
    stride: usize,
}

impl Conv {
    pub fn new(params: &mut Params, name: &str, shape: &[usize], stride: usize) -> Result<Self> {
        Ok(Self {
            weight: params.trainable(&format!("{name}.weight"), shape, Init::Glorot)?,
            bias: params.trainable(&format!("{name}.bias"), &shape[..1], Init::Constant(0.0))?,
            stride,
        })
    }

    /// [B, T, C] to [B, T', O].
    pub fn forward(&self, x: &Tensor) -> Result<Tensor> {
        conv(x, &self.weight, &self.bias, same(x, &self.weight, self.stride)?)
    }
}

/// The convolution of these sizes, on any device.
pub fn conv(x: &Tensor, weight: &Tensor, bias: &Tensor, sizes: ConvSizes) -> Result<Tensor> {
    if crate::nn::device::needs_fallback(x) {
        return fallback::conv(x, weight, bias, &sizes);
    }
    x.contiguous()?.apply_op3(weight, bias, ConvOp { sizes })
}

struct ConvOp {
    sizes: ConvSizes,
}

impl CustomOp3 for ConvOp {
    fn name(&self) -> &'static str {
        "convolution, channels last"
    }

    fn cpu_fwd(
        &self,
        x: &CpuStorage,
        lx: &Layout,
        w: &CpuStorage,
        lw: &Layout,
        b: &CpuStorage,
        lb: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let s = &self.sizes;
        let y = if is_f64(x.dtype())? {
            CpuStorage::F64(direct_conv::forward(s, slice(x, lx)?, slice(w, lw)?, slice(b, lb)?, |_, _| {}))
        } else {
            CpuStorage::F32(direct_conv::forward(s, slice(x, lx)?, slice(w, lw)?, slice(b, lb)?, |_, _| {}))
        };
        Ok((y, shape_out(s, lx.dims().len())))
    }

    fn bwd(
        &self,
        x: &Tensor,
        weight: &Tensor,
        bias: &Tensor,
        _y: &Tensor,
        grad: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>, Option<Tensor>)> {
        fn typed<T: Scalar>(
            s: &ConvSizes,
            x: &Tensor,
            w: &Tensor,
            b: &Tensor,
            grad: &Tensor,
        ) -> Result<[Option<Tensor>; 3]> {
            read::<T, _>(grad, |grad| {
                let [of_x, of_weight] = gradients(s, x, w, grad)?;
                let sums = channel_stats::sums(grad, s.n_out);
                let sums: Vec<T> = sums.into_iter().map(T::from_f64).collect();
                Ok([of_x, of_weight, Some(Tensor::from_vec(sums, b.shape(), b.device())?)])
            })
        }
        let typed = if is_f64(x.dtype())? { typed::<f64> } else { typed::<f32> };
        let [of_x, of_weight, of_bias] = typed(&self.sizes, x, weight, bias, grad)?;
        Ok((of_x, of_weight, of_bias))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::ops::gradcheck::{pattern, worst};

    fn convolve(v: &[Tensor], sizes: ConvSizes) -> Result<Tensor> {
        v[0].apply_op3(&v[1], &v[2], ConvOp { sizes })
    }

    /// The sum as written in a textbook.
    fn by_definition(s: &ConvSizes, v: &[Tensor]) -> Result<Vec<f64>> {
        let [x, weight, bias] = [0, 1, 2].map(|i| v[i].flatten_all().and_then(|v| v.to_vec1::<f64>()));
        let (x, weight, bias, [rows, columns]) = (x?, weight?, bias?, s.axes);
        let place = |i: usize| (i / columns.n_out / rows.n_out, i / columns.n_out % rows.n_out, i % columns.n_out);
        let one = |i: usize| {
            let ((b, row, column), o) = (place(i / s.n_out), i % s.n_out);
            let offsets = (0..rows.kernel).flat_map(|down| (0..columns.kernel).map(move |across| (down, across)));
            let inside = offsets.filter_map(|(down, across)| {
                let at = |axis: ConvAxis, out: usize, offset: usize| {
                    (out * axis.stride + offset).checked_sub(axis.pad).filter(|at| *at < axis.n_in)
                };
                let place = (b * rows.n_in + at(rows, row, down)?) * columns.n_in + at(columns, column, across)?;
                let product = |c: usize| {
                    x[place * s.n_in + c] * weight[((o * s.n_in + c) * rows.kernel + down) * columns.kernel + across]
                };
                Some((0..s.n_in).map(product).sum::<f64>())
            });
            bias[o] + inside.sum::<f64>()
        };
        Ok((0..s.len_out()).map(one).collect())
    }

    #[test]
    fn forward_and_gradients_are_right() -> Result<()> {
        let same = |n, kernel, stride| ConvAxis::same(n, kernel, stride);
        let alone = ConvAxis::valid(1, 1);
        for (n_in, n_out, axes) in [
            (3, 5, [same(9, 3, 1), alone]),
            (2, 3, [same(9, 1, 1), alone]),
            (2, 3, [same(1, 4, 2), alone]),
            (8, 9, [same(13, 4, 2), alone]),
            (2, 3, [same(8, 4, 1), alone]),
            (1, 9, [same(5, 3, 1), same(6, 3, 1)]),
            (3, 2, [same(7, 4, 2), same(6, 4, 2)]),
            (2, 3, [same(6, 4, 2), same(9, 4, 2)]),
            (7, 1, [ConvAxis::valid(5, 3), ConvAxis::valid(4, 4)]),
        ] {
            let s = ConvSizes { batch: 2, n_in, n_out, axes };
            let weight = [n_out, n_in, axes[0].kernel, axes[1].kernel];
            let inputs = [
                pattern(&[2, axes[0].n_in, axes[1].n_in, n_in], 0.0)?,
                pattern(&weight, 7.0)?,
                pattern(&[n_out], 3.0)?,
            ];
            let y = convolve(&inputs, s)?.flatten_all()?.to_vec1::<f64>()?;
            let expected = by_definition(&s, &inputs)?;
            assert_eq!(y.len(), expected.len());
            assert!(y.iter().zip(&expected).all(|(y, e)| (y - e).abs() < 1e-12), "{s:?}");
            let error = worst(&inputs, |v| convolve(v, s))?;
            assert!(error < 1e-7, "{s:?}: {error}");
        }
        Ok(())
    }

    #[test]
    fn panels_of_every_width_are_right() -> Result<()> {
        for (n_in, n_out) in [(70, 96), (5, 113)] {
            let s = ConvSizes { batch: 2, n_in, n_out, axes: [ConvAxis::same(6, 4, 2), ConvAxis::same(3, 3, 1)] };
            let inputs =
                [pattern(&[2, 6, 3, n_in], 0.0)?, pattern(&[n_out, n_in, 4, 3], 7.0)?, pattern(&[n_out], 3.0)?];
            let y = convolve(&inputs, s)?.flatten_all()?.to_vec1::<f64>()?;
            assert!(y.iter().zip(by_definition(&s, &inputs)?).all(|(y, e)| (y - e).abs() < 1e-10));
            // The gradients against the sum they are the transposes of: <grad, conv(x)> = <grad of x, x>.
            let vars = inputs.each_ref().map(candle_core::Var::from_tensor);
            let [x, w, b] = vars;
            let (x, w, b) = (x?, w?, b?);
            let g = pattern(&[2, 3, 3, n_out], 9.0)?;
            let all = convolve(&[x.as_tensor().clone(), w.as_tensor().clone(), b.as_tensor().clone()], s)?;
            let gradients = (all * &g)?.sum_all()?.backward()?;
            let inner = |var: &candle_core::Var| -> Result<f64> {
                let Some(gradient) = gradients.get(var) else { candle_core::bail!("no gradient") };
                (gradient * var.as_tensor())?.sum_all()?.to_scalar()
            };
            let without_bias = convolve(&[inputs[0].clone(), inputs[1].clone(), inputs[2].zeros_like()?], s)?;
            let expected: f64 = (without_bias * &g)?.sum_all()?.to_scalar()?;
            assert!((inner(&x)? - expected).abs() < 1e-9 && (inner(&w)? - expected).abs() < 1e-9);
        }
        Ok(())
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() -> Result<()> {
        let f32s = |shape: &[usize], phase| pattern(shape, phase)?.to_dtype(candle_core::DType::F32);
        let (x, bias) = (f32s(&[3, 21, 10, 20], 0.0)?, f32s(&[70], 5.0)?);
        let weight = candle_core::Var::from_tensor(&f32s(&[70, 20, 4, 4], 1.0)?)?;
        let s = same(&x, &weight, 2)?;
        let run = |n_threads| -> Result<Vec<Vec<f32>>> {
            let pool =
                rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().map_err(candle_core::Error::wrap)?;
            pool.install(|| {
                let y = convolve(&[x.clone(), weight.as_tensor().clone(), bias.clone()], s)?;
                let gradients = y.sqr()?.sum_all()?.backward()?;
                let gradient = gradients.get(&weight).ok_or_else(|| candle_core::Error::msg("no gradient"))?;
                Ok(vec![y.flatten_all()?.to_vec1()?, gradient.flatten_all()?.to_vec1()?])
            })
        };
        assert_eq!(run(1)?, run(3)?);
        Ok(())
    }

    #[test]
    fn what_does_not_fit_is_an_error() -> Result<()> {
        let x = pattern(&[2, 3, 4], 0.0)?;
        assert!(same(&x, &pattern(&[5, 4, 3], 0.0)?, 1).is_ok());
        assert!(same(&x, &pattern(&[5, 3, 3], 0.0)?, 1).is_err());
        assert!(same(&x, &pattern(&[5, 4, 3, 3], 0.0)?, 1).is_err());
        assert!(valid(&x, &pattern(&[5, 4, 4], 0.0)?).is_err());
        Ok(())
    }
}
