//! Adapter from the operators of this crate to custom operators of candle: forward and backward pass, written once for
//! f32 and f64, on contiguous memory of the CPU.

use crate::cpu::tensor::{Scalar, is_f64, read, slice};
use candle_core::backend::BackendStorage;
use candle_core::{CpuStorage, CustomOp3, Layout, Result, Shape, Tensor};

pub struct Operand<'a, T> {
    pub values: &'a [T],
    pub dims: &'a [usize],
    /// Whether its gradient is required.
    pub tracked: bool,
}

/// Gradients of the three operands; `None`: not required.
pub type Gradients<T> = Result<[Option<Vec<T>>; 3]>;

pub trait CpuOperator: Send + Sync {
    const NAME: &'static str;

    fn forward<T: Scalar>(&self, operands: [Operand<T>; 3]) -> Result<(Vec<T>, Shape)>;

    fn backward<T: Scalar>(&self, operands: [Operand<T>; 3], y: &[T], grad: &[T]) -> Gradients<T>;
}

/// Adapter of an operator for `Tensor::apply_op3`.
pub struct CustomOperator<O>(pub O);

impl<O: CpuOperator> CustomOp3 for CustomOperator<O> {
    fn name(&self) -> &'static str {
        O::NAME
    }

    fn cpu_fwd(
        &self,
        a: &CpuStorage,
        layout_a: &Layout,
        b: &CpuStorage,
        layout_b: &Layout,
        c: &CpuStorage,
        layout_c: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let operands = [(a, layout_a), (b, layout_b), (c, layout_c)];
        if is_f64(a.dtype())? { forward::<f64, O>(&self.0, operands) } else { forward::<f32, O>(&self.0, operands) }
    }

    fn bwd(
        &self,
        a: &Tensor,
        b: &Tensor,
        c: &Tensor,
        y: &Tensor,
        grad: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>, Option<Tensor>)> {
        let backward = if is_f64(grad.dtype())? { backward::<f64, O> } else { backward::<f32, O> };
        Ok(backward(&self.0, [a, b, c], y, grad)?.into())
    }
}

fn forward<T: Scalar, O: CpuOperator>(op: &O, operands: [(&CpuStorage, &Layout); 3]) -> Result<(CpuStorage, Shape)> {
    let [a, b, c] = operands.map(|(storage, layout)| -> Result<_> {
        Ok(Operand { values: slice::<T>(storage, layout)?, dims: layout.dims(), tracked: false })
    });
    let (y, shape) = op.forward([a?, b?, c?])?;
    Ok((T::to_cpu_storage_owned(y), shape))
}

fn backward<T: Scalar, O: CpuOperator>(
    op: &O,
    operands: [&Tensor; 3],
    y: &Tensor,
    grad: &Tensor,
) -> Result<[Option<Tensor>; 3]> {
    let with_values = |a: &[T], b: &[T], c: &[T]| {
        let mut values = [a, b, c].into_iter();
        let operands = operands.map(|of| Operand {
            values: values.next().unwrap_or_default(),
            dims: of.dims(),
            tracked: of.track_op(),
        });
        read(y, |y| read(grad, |grad| op.backward(operands, y, grad)))
    };
    let [a, b, c] = operands;
    let gradients = read(a, |a| read(b, |b| read(c, |c| with_values(a, b, c))))?;
    let mut tensors = [None, None, None];
    for ((tensor, gradient), of) in tensors.iter_mut().zip(gradients).zip(operands) {
        *tensor = gradient.map(|values| Tensor::from_vec(values, of.shape(), of.device())).transpose()?;
    }
    Ok(tensors)
}
