//! Runs the kernels of `kernels.cu` and `training.cu`, and convolutions, on tensors: on a GPU, or with the executor of a
//! test. Tensors are contiguous; a kernel writes to tensors in place.

use candle_core::{CpuStorage, CudaStorage, InplaceOp1, Layout, Result, Shape, Tensor};
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// Threads of a block.
pub const THREADS: usize = 256;
/// Number of results of an element-wise kernel above which a thread computes several.
const MAX_BLOCKS: usize = 1 << 16;

/// Argument block of every kernel, as `kernels.cu` declares it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct KernelArguments {
    /// Addresses; 0: absent.
    pub tensors: [u64; 12],
    pub ints: [i32; 12],
    pub numbers: [f64; 8],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConvolutionPass {
    /// Writes the result.
    Forward,
    /// Writes the gradient of the input; the result is that of the result.
    InputGradient,
    /// Adds the gradient of the weight to the weight; the result is that of the result.
    WeightGradient,
}

/// Sizes of a convolution: zero padding of the same width on both sides, no dilation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConvolutionSizes {
    /// Input [B, C, H, W], weight [O, C, K, K'] and result [B, O, H', W'].
    pub input: [usize; 4],
    pub weight: [usize; 4],
    pub result: [usize; 4],
    pub padding: [usize; 2],
    pub stride: [usize; 2],
}

/// What runs kernels on tensors that are not on a GPU: the tests' compilation for the CPU, which also counts.
pub trait KernelExecutor {
    /// Runs `n_blocks` blocks of a kernel on tensors of f64 or f32.
    fn run(&self, kernel: &str, is_f64: bool, arguments: &KernelArguments, n_blocks: usize);
    /// Runs a convolution on the addresses of input, weight and result.
    fn convolve(&self, pass: ConvolutionPass, sizes: &ConvolutionSizes, is_f64: bool, addresses: [u64; 3]);
    /// Notes a backward pass through a graph of this many operations of candle.
    fn note_graph(&self, n_nodes: usize);
    /// Notes that values are read from the device.
    fn note_read(&self);
}

thread_local!(static EXECUTOR: RefCell<Option<Rc<dyn KernelExecutor>>> = const { RefCell::new(None) });

/// Calls `f`; until it returns, tensors on the CPU are treated as if on a GPU, whose kernels `executor` runs. For tests.
pub fn with_executor<R>(executor: Rc<dyn KernelExecutor>, f: impl FnOnce() -> R) -> R {
    let previous = EXECUTOR.replace(Some(executor));
    let result = f();
    EXECUTOR.set(previous);
    result
}

pub(super) fn executor() -> Option<Rc<dyn KernelExecutor>> {
    EXECUTOR.with_borrow(Clone::clone)
}

/// Whether the operations of this module compute with `x`, instead of the kernels for the CPU.
pub fn is_on_device(x: &Tensor) -> bool {
    !x.device().is_cpu() || EXECUTOR.with_borrow(Option::is_some)
}

/// Reads the values of a tensor, after the device has finished all pending work.
pub fn read(x: &Tensor) -> Result<Vec<f32>> {
    if let Some(executor) = executor() {
        executor.note_read();
    }
    x.flatten_all()?.to_vec1()
}

/// New tensor with the type and device of `like`, without defined values, for the result of a kernel.
pub fn result(shape: impl Into<Shape>, like: &Tensor) -> Result<Tensor> {
    // SAFETY: every caller passes the tensor to a kernel that writes all of its values, before anything reads it.
    unsafe { Tensor::empty(shape, like.dtype(), like.device()) }
}

/// Number of blocks for a kernel with `n` independent results.
pub fn blocks(n: usize) -> usize {
    n.div_ceil(THREADS).clamp(1, MAX_BLOCKS)
}

/// Runs `n_blocks` blocks of a kernel; see its first lines for the order of tensors (`None`: absent), integers and numbers.
///
/// # Errors
/// A tensor that is not contiguous, or has more values than 32 bits count; no GPU.
pub fn run(
    kernel: &'static str,
    tensors: &[Option<&Tensor>],
    ints: &[usize],
    numbers: &[f64],
    n_blocks: usize,
) -> Result<()> {
    let mut arguments = KernelArguments::default();
    for (to, tensor) in arguments.tensors.iter_mut().zip(tensors) {
        *to = tensor.map_or(Ok(0), address)?;
    }
    for (to, value) in arguments.ints.iter_mut().zip(ints) {
        *to = i32::try_from(*value).map_err(candle_core::Error::wrap)?;
    }
    arguments.numbers.iter_mut().zip(numbers).for_each(|(to, number)| *to = *number);
    // Tables of addresses are integers.
    let Some(values) = tensors.iter().flatten().find(|tensor| tensor.dtype().is_float()) else {
        candle_core::bail!("kernel {kernel} without tensors of numbers");
    };
    match executor() {
        Some(executor) => executor.run(kernel, is_f64(values), &arguments, n_blocks),
        None => on_gpu(values, kernel, &arguments, n_blocks)?,
    }
    Ok(())
}

/// Runs one pass of a convolution; `pass` determines which of `input`, `weight` and `result` it writes. Sums have a fixed
/// order.
pub fn convolve(pass: ConvolutionPass, sizes: &ConvolutionSizes, tensors: [&Tensor; 3]) -> Result<()> {
    let [input, weight, result] = tensors.map(address);
    let addresses = [input?, weight?, result?];
    match executor() {
        Some(executor) => executor.convolve(pass, sizes, is_f64(tensors[0]), addresses),
        None => convolve_on_gpu(pass, sizes, tensors[0], addresses)?,
    }
    Ok(())
}

fn is_f64(tensor: &Tensor) -> bool {
    tensor.dtype() == candle_core::DType::F64
}

#[cfg(feature = "cuda")]
use super::cuda::{convolve_on_gpu, on_gpu};

#[cfg(not(feature = "cuda"))]
fn on_gpu(_: &Tensor, kernel: &str, _: &KernelArguments, _: usize) -> Result<()> {
    candle_core::bail!("cannot run kernel {kernel}: the program was built without the feature `cuda`")
}

#[cfg(not(feature = "cuda"))]
fn convolve_on_gpu(_: ConvolutionPass, _: &ConvolutionSizes, _: &Tensor, _: [u64; 3]) -> Result<()> {
    candle_core::bail!("cannot run a convolution: the program was built without the feature `cuda`")
}

/// Address of the first value of a tensor in the memory of its device, which is constant as long as the tensor exists.
pub fn address(tensor: &Tensor) -> Result<u64> {
    let query = AddressQuery(Cell::new(0));
    tensor.inplace_op1(&query)?;
    Ok(query.0.get())
}

/// In-place operator that only reads the address of the storage.
struct AddressQuery(Cell<u64>);

impl AddressQuery {
    /// Start of a contiguous tensor in its storage.
    fn start(layout: &Layout) -> Result<usize> {
        if i32::try_from(layout.shape().elem_count()).is_err() {
            candle_core::bail!("a tensor of shape {:?} is too large for the GPU: use a smaller batch", layout.dims());
        }
        match layout.contiguous_offsets() {
            Some((start, _)) => Ok(start),
            None => candle_core::bail!("a kernel needs contiguous tensors, found strides {:?}", layout.stride()),
        }
    }
}

impl InplaceOp1 for AddressQuery {
    fn name(&self) -> &'static str {
        "address"
    }

    fn cpu_fwd(&self, storage: &mut CpuStorage, layout: &Layout) -> Result<()> {
        let start = Self::start(layout)?;
        self.0.set(match storage {
            CpuStorage::F32(values) => values[start..].as_mut_ptr() as u64,
            CpuStorage::F64(values) => values[start..].as_mut_ptr() as u64,
            CpuStorage::I64(values) => values[start..].as_mut_ptr() as u64,
            _ => candle_core::bail!("a kernel needs tensors of f32, f64 or i64"),
        });
        Ok(())
    }

    #[cfg(feature = "cuda")]
    fn cuda_fwd(&self, storage: &mut CudaStorage, layout: &Layout) -> Result<()> {
        self.0.set(super::cuda::address(storage, Self::start(layout)?)?);
        Ok(())
    }

    #[cfg(not(feature = "cuda"))]
    fn cuda_fwd(&self, _: &mut CudaStorage, _: &Layout) -> Result<()> {
        Err(candle_core::Error::NotCompiledWithCudaSupport)
    }
}
