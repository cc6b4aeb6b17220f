//! A fully connected layer over the last axis, including bias and ReLU, as one operator, for many rows and few
//! columns. Each chunk of rows is processed by one thread; results do not depend on the number of threads.

use super::operator::{CpuOperator, CustomOperator, Gradients, Operand};
use crate::cpu::packed_matrix::PackedMatrix;
use crate::cpu::spin_pool::parallel_each;
use crate::cpu::tensor::{Matrix, Scalar, add_product};
use crate::params::{Init, Params};
use candle_core::{D, Module, Result, Shape, Tensor};

/// Number of rows that are multiplied before their sums are stored.
const ROWS: usize = 48;
/// Maximum number of chunks, and minimum number of rows per chunk.
const MAX_CHUNKS: usize = 8;
const MIN_CHUNK_ROWS: usize = 128;

/// Tensors `<name>.weight` [out, in] and `<name>.bias` [out], both initially uniform in +-1 / sqrt(in), as in PyTorch.
pub struct Affine {
    weight: Tensor,
    bias: Tensor,
    relu: bool,
}

impl Affine {
    pub fn new(params: &mut Params, name: &str, n_in: usize, n_out: usize) -> Result<Self> {
        let init = Init::Uniform(1.0 / (n_in as f64).sqrt());
        let (weight, bias) = params.layer(name, &[n_out, n_in], init, init)?;
        Ok(Self { weight, bias, relu: false })
    }

    /// Layer of existing tensors, without ReLU.
    pub fn of(weight: Tensor, bias: Tensor) -> Self {
        Self { weight, bias, relu: false }
    }

    pub fn with_relu(self) -> Self {
        Self { relu: true, ..self }
    }

    pub fn weight(&self) -> &Tensor {
        &self.weight
    }

    pub fn bias(&self) -> &Tensor {
        &self.bias
    }
}

impl Module for Affine {
    /// Maps [..., in] to [..., out].
    fn forward(&self, x: &Tensor) -> Result<Tensor> {
        affine(x, &self.weight, &self.bias, self.relu)
    }
}

/// Computes `x` [..., in] times the transposed `weight` [out, in] plus `bias` [out], with a ReLU if `relu` is set.
pub fn affine(x: &Tensor, weight: &Tensor, bias: &Tensor, relu: bool) -> Result<Tensor> {
    let (mut shape, n_in) = (x.dims().to_vec(), x.dim(D::Minus1)?);
    let y = x.contiguous()?.reshape(((), n_in))?.apply_op3(weight, bias, CustomOperator(AffineOp { relu }))?;
    if let Some(last) = shape.last_mut() {
        *last = bias.dim(0)?;
    }
    y.reshape(shape)
}

struct AffineOp {
    relu: bool,
}

/// Number of rows, inputs per row and outputs per row.
type AffineSizes = (usize, usize, usize);

fn sizes(x: &[usize], weight: &[usize], n_bias: usize) -> Result<AffineSizes> {
    match (x, weight) {
        (&[n, n_in], &[n_out, w_in]) if n_in == w_in && n_bias == n_out && n * n_in * n_out > 0 => Ok((n, n_in, n_out)),
        _ => candle_core::bail!("linear: input {x:?} does not fit weight {weight:?} and bias {n_bias}"),
    }
}

fn chunk(n: usize) -> usize {
    n.div_ceil(MAX_CHUNKS).max(MIN_CHUNK_ROWS).next_multiple_of(ROWS)
}

/// Multiplies rows of `x` with a matrix, some at a time; `store` receives the index of the first row and the products.
fn products<T: Scalar>(x: &[T], n_in: usize, by: &PackedMatrix<T>, mut store: impl FnMut(usize, &[T])) {
    let mut sums = vec![T::zero(); ROWS * by.width()];
    for (i, x) in x.chunks(ROWS * n_in).enumerate() {
        let sums = &mut sums[..x.len() / n_in * by.width()];
        sums.fill(T::zero());
        by.multiply_add(x.len() / n_in, x, n_in, sums, by.width());
        store(i * ROWS, sums);
    }
}

impl CpuOperator for AffineOp {
    const NAME: &'static str = "linear layer";

    fn forward<T: Scalar>(&self, [x, weight, bias]: [Operand<T>; 3]) -> Result<(Vec<T>, Shape)> {
        let (n, n_in, n_out) = sizes(x.dims, weight.dims, bias.values.len())?;
        let packed = PackedMatrix::new(n_in, n_out, |k, c| weight.values[c * n_in + k]);
        let (chunk, zero) = (chunk(n), T::zero());
        let mut y = vec![zero; n * n_out];
        let chunks = y.chunks_mut(chunk * n_out).zip(x.values.chunks(chunk * n_in));
        parallel_each(chunks, |_, (y, x)| {
            products(x, n_in, &packed, |first, sums| {
                let rows = y[first * n_out..].chunks_exact_mut(n_out).zip(sums.chunks_exact(packed.width()));
                for (y, sums) in rows {
                    for ((y, sum), bias) in y.iter_mut().zip(sums).zip(bias.values) {
                        let value = *sum + *bias;
                        *y = if self.relu && value < zero { zero } else { value };
                    }
                }
            });
        });
        Ok((y, Shape::from((n, n_out))))
    }

    fn backward<T: Scalar>(&self, [x, weight, bias]: [Operand<T>; 3], y: &[T], grad: &[T]) -> Gradients<T> {
        let (n, n_in, n_out) = sizes(x.dims, weight.dims, bias.values.len())?;
        let packed = PackedMatrix::new(n_out, n_in, |k, c| weight.values[k * n_in + c]);
        let (chunk, zero) = (chunk(n), T::zero());
        let mut of_x = vec![zero; if x.tracked { n * n_in } else { 0 }];
        let mut none: Vec<&mut [T]> = (0..n.div_ceil(chunk)).map(|_| <&mut [T]>::default()).collect();
        if x.tracked {
            none = of_x.chunks_mut(chunk * n_in).collect();
        }
        let outputs = y.chunks(chunk * n_out).zip(grad.chunks(chunk * n_out));
        let chunks = none.into_iter().zip(x.values.chunks(chunk * n_in)).zip(outputs);
        let parts = parallel_each(chunks, |_, ((of_x, x), (y, grad))| {
            let cut: Vec<T>;
            let grad = if self.relu {
                cut = y.iter().zip(grad).map(|(y, grad)| if *y > zero { *grad } else { zero }).collect();
                &cut[..]
            } else {
                grad
            };
            let mut part = vec![zero; n_out * n_in + n_out];
            let (of_weight, of_bias) = part.split_at_mut(n_out * n_in);
            let rows = Matrix::new(grad, n_out).transposed();
            add_product(of_weight, rows, Matrix::new(x, n_in), n_out, n_in, grad.len() / n_out);
            for row in grad.chunks_exact(n_out) {
                of_bias.iter_mut().zip(row).for_each(|(sum, value)| *sum += *value);
            }
            if !of_x.is_empty() {
                products(grad, n_out, &packed, |first, sums| {
                    let rows = of_x[first * n_in..].chunks_exact_mut(n_in).zip(sums.chunks_exact(packed.width()));
                    rows.for_each(|(to, sums)| to.copy_from_slice(&sums[..n_in]));
                });
            }
            part
        });
        let mut of_weight = vec![zero; n_out * n_in + n_out];
        for part in &parts {
            of_weight.iter_mut().zip(part).for_each(|(sum, value)| *sum += *value);
        }
        let of_bias = of_weight.split_off(n_out * n_in);
        Ok([x.tracked.then_some(of_x), Some(of_weight), Some(of_bias)])
    }
}
