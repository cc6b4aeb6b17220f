//! A convolution followed by bias, batch norm and leaky ReLU, forward and backward, in two kernels each way.

use super::gradients::slot;
use super::launch::{ConvolutionPass, ConvolutionSizes, blocks, convolve, result, run};
use crate::cpu::axis::Padding;
use crate::ops::batch_norm::BatchNorm;
use candle_core::{CpuStorage, CudaStorage, CustomOp2, InplaceOp1, Layout, Result, Shape, Tensor};
use std::cell::RefCell;

/// Parameters and settings of a layer; clones share the parameters.
#[derive(Clone)]
pub struct DeviceLayer {
    /// [O, C, K], over the last axis, or [O, C, K, K'].
    pub weight: Tensor,
    pub bias: Tensor,
    /// Its activation is `slope`.
    pub norm: Option<BatchNorm>,
    pub stride: usize,
    pub padding: Padding,
    /// Factor of negative results.
    pub slope: f64,
}

/// Values of a forward pass that the backward pass needs.
pub struct LayerRecord {
    sizes: ConvolutionSizes,
    /// Height and width of the input before it was extended, and the number of columns added before it.
    input: [usize; 2],
    n_before: usize,
    x: Tensor,
    z: Tensor,
    statistics: Tensor,
    mode: NormMode,
    groups: usize,
}

/// Statistics of the batch norm, as `kernels.cu` numbers them.
#[derive(Clone, Copy, PartialEq, Eq)]
enum NormMode {
    None = 0,
    Batch = 1,
    Running = 2,
}

impl DeviceLayer {
    /// Computes the result [B, O, H', W'] for `x` [B, C, H, W]. In training, each of `groups` equal parts of the batch is
    /// normalised by itself.
    pub fn forward(&self, x: &Tensor, train: bool, groups: usize) -> Result<(Tensor, LayerRecord)> {
        let (batch, _, height, width) = x.dims4()?;
        let (sizes, n_before) = self.sizes(x)?;
        let extended = [sizes.input[2], sizes.input[3]];
        let x = match extended == [height, width] {
            true => x.contiguous()?,
            false => resized(x, extended, [0, n_before])?,
        };
        let z = result(&sizes.result, &x)?;
        convolve(ConvolutionPass::Forward, &sizes, [&x, &self.weight, &z])?;
        let mode = match (&self.norm, train) {
            (None, _) => NormMode::None,
            (_, true) => NormMode::Batch,
            (_, false) => NormMode::Running,
        };
        let (y, statistics) = (result(&sizes.result, &x)?, result((groups, sizes.result[1], 2), &x)?);
        let norm = self.norm.as_ref();
        let (eps, momentum) = norm.map_or((0.0, 0.0), |norm| (norm.eps, norm.momentum));
        let running = norm.map(|norm| [norm.running_mean.as_tensor(), norm.running_var.as_tensor()]);
        let [weight, bias] = [norm.map(|norm| &norm.weight), norm.map(|norm| &norm.bias)];
        run(
            "normalise_forward",
            &[
                Some(&z),
                Some(&self.bias),
                weight,
                bias,
                running.map(|[mean, _]| mean),
                running.map(|[_, variance]| variance),
                Some(&y),
                Some(&statistics),
            ],
            &norm_ints(batch, &sizes, groups, mode),
            &[eps, momentum, self.slope],
            sizes.result[1],
        )?;
        Ok((y, LayerRecord { sizes, input: [height, width], n_before, x, z, statistics, mode, groups }))
    }

    /// Adds the gradients of the parameters to those of the running backward pass; returns that of the input, if
    /// `needs_input`.
    pub fn backward(&self, record: &LayerRecord, grad: &Tensor, needs_input: bool) -> Result<Option<Tensor>> {
        let LayerRecord { sizes, input, n_before, x, z, statistics, mode, groups } = record;
        let (norm, grad_z) = (self.norm.as_ref(), result(z.shape(), z)?);
        let [of_weight, of_bias] = [norm.and_then(|norm| slot(&norm.weight)), norm.and_then(|norm| slot(&norm.bias))];
        run(
            "normalise_backward",
            &[
                Some(z),
                Some(&self.bias),
                norm.map(|norm| &norm.weight),
                norm.map(|norm| &norm.bias),
                Some(statistics),
                Some(&grad.contiguous()?),
                Some(&grad_z),
                slot(&self.bias).as_ref(),
                of_weight.as_ref(),
                of_bias.as_ref(),
            ],
            &norm_ints(sizes.input[0], sizes, *groups, *mode),
            &[self.slope],
            sizes.result[1],
        )?;
        if let Some(of_weight) = slot(&self.weight) {
            convolve(ConvolutionPass::WeightGradient, sizes, [x, &of_weight, &grad_z])?;
        }
        if !needs_input {
            return Ok(None);
        }
        let grad_x = result(x.shape(), x)?;
        convolve(ConvolutionPass::InputGradient, sizes, [&grad_x, &self.weight, &grad_z])?;
        if sizes.input[2..] == *input { Ok(Some(grad_x)) } else { resized(&grad_x, *input, [*n_before, 0]).map(Some) }
    }

    /// Sizes of the convolution of the input with the zeros at its start or end that make the padding symmetrical, and
    /// the number of columns of zeros at its start.
    fn sizes(&self, x: &Tensor) -> Result<(ConvolutionSizes, usize)> {
        let (batch, n_in, height, width) = x.dims4()?;
        let (n_out, kernel, strides) = match *self.weight.dims() {
            [n_out, channels, width] if channels == n_in => (n_out, [1, width], [1, self.stride]),
            [n_out, channels, height, width] if channels == n_in => (n_out, [height, width], [self.stride; 2]),
            _ => candle_core::bail!("convolution: input {:?} does not fit weight {:?}", x.dims(), self.weight.dims()),
        };
        let mut axes =
            [self.padding.axis(height, kernel[0], strides[0]), self.padding.axis(width, kernel[1], strides[1])];
        let n_before = if self.padding == Padding::Causal { std::mem::take(&mut axes[1].pad) } else { 0 };
        axes[1].n_in += n_before;
        if batch == 0 || axes.iter().any(|axis| axis.n_out == 0) {
            candle_core::bail!("convolution: input {:?} is too short for weight {:?}", x.dims(), self.weight.dims());
        }
        let extended = axes.map(|axis| axis.n_in.max(((axis.n_out - 1) * axis.stride + axis.kernel) - 2 * axis.pad));
        let sizes = ConvolutionSizes {
            input: [batch, n_in, extended[0], extended[1]],
            weight: [n_out, n_in, kernel[0], kernel[1]],
            result: [batch, n_out, axes[0].n_out, axes[1].n_out],
            padding: axes.map(|axis| axis.pad),
            stride: strides,
        };
        Ok((sizes, n_before))
    }
}

fn norm_ints(batch: usize, sizes: &ConvolutionSizes, groups: usize, mode: NormMode) -> [usize; 5] {
    let [_, channels, height, width] = sizes.result;
    [batch, channels, height * width, groups, mode as usize]
}

/// Cuts height and width of `x` [B, C, H, W], or extends them by zeros, at their end; before, `cut` columns are removed
/// and `added` ones inserted at the start.
fn resized(x: &Tensor, [height, width]: [usize; 2], [cut, added]: [usize; 2]) -> Result<Tensor> {
    let ((batch, channels, rows, columns), x) = (x.dims4()?, x.contiguous()?);
    let y = result((batch, channels, height, width), &x)?;
    let ints = [batch * channels, rows, columns, height, width, cut, added];
    run("resize", &[Some(&x), Some(&y)], &ints, &[], blocks(y.elem_count()))?;
    Ok(y)
}

/// Turns `y`, computed from `x` with `parameter` outside of candle's graph, into an operation of the graph. `backward` maps
/// its gradient to that of `x`, which it may omit if `x` is not tracked; gradients of parameters are its own task.
pub fn attached(
    y: Tensor,
    x: &Tensor,
    parameter: &Tensor,
    backward: impl Fn(&Tensor) -> Result<Option<Tensor>> + Send + Sync + 'static,
) -> Result<Tensor> {
    if !x.track_op() && !parameter.track_op() {
        return Ok(y);
    }
    let op = AttachedBackward { shape: y.shape().clone(), value: y, backward: Box::new(backward) };
    x.apply_op2(parameter, op)
}

type BackwardPass = Box<dyn Fn(&Tensor) -> Result<Option<Tensor>> + Send + Sync>;

struct AttachedBackward {
    value: Tensor,
    shape: Shape,
    backward: BackwardPass,
}

impl CustomOp2 for AttachedBackward {
    fn name(&self) -> &'static str {
        "attached backward pass"
    }

    fn cpu_fwd(&self, _: &CpuStorage, _: &Layout, _: &CpuStorage, _: &Layout) -> Result<(CpuStorage, Shape)> {
        let taken = TakenStorage::default();
        self.value.inplace_op1(&taken)?;
        taken.cpu.into_inner().map(|storage| (storage, self.shape.clone())).ok_or_else(no_storage)
    }

    fn cuda_fwd(&self, _: &CudaStorage, _: &Layout, _: &CudaStorage, _: &Layout) -> Result<(CudaStorage, Shape)> {
        let taken = TakenStorage::default();
        self.value.inplace_op1(&taken)?;
        taken.cuda.into_inner().map(|storage| (storage, self.shape.clone())).ok_or_else(no_storage)
    }

    fn bwd(&self, _: &Tensor, _: &Tensor, _: &Tensor, grad: &Tensor) -> Result<(Option<Tensor>, Option<Tensor>)> {
        Ok(((self.backward)(grad)?, None))
    }
}

fn no_storage() -> candle_core::Error {
    candle_core::Error::Msg("an attached backward pass has no value".to_owned())
}

/// In-place operator that takes the memory of a tensor, which is not used afterwards.
#[derive(Default)]
struct TakenStorage {
    cpu: RefCell<Option<CpuStorage>>,
    cuda: RefCell<Option<CudaStorage>>,
}

impl InplaceOp1 for TakenStorage {
    fn name(&self) -> &'static str {
        "take"
    }

    fn cpu_fwd(&self, storage: &mut CpuStorage, _: &Layout) -> Result<()> {
        self.cpu.replace(Some(std::mem::replace(storage, CpuStorage::F32(Vec::new()))));
        Ok(())
    }

    #[cfg(feature = "cuda")]
    fn cuda_fwd(&self, storage: &mut CudaStorage, _: &Layout) -> Result<()> {
        let replacement = super::cuda::placeholder(storage)?;
        self.cuda.replace(Some(std::mem::replace(storage, replacement)));
        Ok(())
    }

    #[cfg(not(feature = "cuda"))]
    fn cuda_fwd(&self, _: &mut CudaStorage, _: &Layout) -> Result<()> {
        Err(candle_core::Error::NotCompiledWithCudaSupport)
    }
}
