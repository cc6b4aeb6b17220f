//! Kernels and convolutions on a GPU: the compiled kernels of this crate, and cuDNN with algorithms whose sums have a fixed
//! order.

use super::launch::{ConvolutionPass, ConvolutionSizes, KernelArguments, THREADS};
use candle_core::cuda_backend::cudarc::cudnn::sys::{
    cudnnConvolutionBwdDataAlgo_t as InputAlgorithm, cudnnConvolutionBwdFilterAlgo_t as WeightAlgorithm,
    cudnnConvolutionFwdAlgo_t as ForwardAlgorithm, cudnnConvolutionMode_t as Mode, cudnnTensorFormat_t as Format,
};
use candle_core::cuda_backend::cudarc::cudnn::{ConvBackwardData, ConvBackwardFilter, ConvForward, Cudnn, CudnnError};
use candle_core::cuda_backend::cudarc::driver::{
    CudaSlice, CudaStream, DevicePtr, DevicePtrMut, DeviceRepr, DeviceSlice, LaunchConfig, PushKernelArg, SyncOnDrop,
};
use candle_core::cuda_backend::{CudaDType, DeviceId};
use candle_core::{CudaDevice, CudaStorage, DType, Error, Result, Tensor};
use std::cell::RefCell;
use std::mem::ManuallyDrop;
use std::sync::Arc;

/// `kernels.cu` and `training.cu`, compiled by the build script.
const KERNELS: &str = include_str!(concat!(env!("OUT_DIR"), "/kernels.ptx"));

// SAFETY: plain numbers in the layout of C, as the kernels declare them.
unsafe impl DeviceRepr for KernelArguments {}

/// Runs a kernel on the GPU of `values`.
pub(super) fn on_gpu(values: &Tensor, kernel: &str, arguments: &KernelArguments, n_blocks: usize) -> Result<()> {
    ensure_f32(values)?;
    let function = values.device().as_cuda_device()?.get_or_load_custom_func(kernel, "orator", KERNELS)?;
    let (grid_dim, block_dim) = ((n_blocks as u32, 1, 1), (THREADS as u32, 1, 1));
    let mut launch = function.builder();
    launch.arg(arguments);
    // SAFETY: the kernel takes this argument block, with the addresses of contiguous tensors of the shapes that it assumes;
    // they are freed in the order of this stream.
    unsafe { launch.launch(LaunchConfig { grid_dim, block_dim, shared_mem_bytes: 0 }) }.map_err(Error::wrap)?;
    Ok(())
}

fn ensure_f32(tensor: &Tensor) -> Result<()> {
    match tensor.dtype() {
        DType::F32 => Ok(()),
        other => candle_core::bail!("networks on a GPU need tensors of f32, found {other:?}"),
    }
}

/// Address of value `start` of a tensor's memory.
pub(super) fn address(storage: &mut CudaStorage, start: usize) -> Result<u64> {
    fn of<T: CudaDType>(storage: &mut CudaStorage, start: usize) -> Result<u64> {
        let slice: &mut CudaSlice<T> = storage.as_cuda_slice_mut()?;
        let stream = slice.stream().clone();
        let (address, _order) = slice.device_ptr_mut(&stream);
        Ok(address + (start * size_of::<T>()) as u64)
    }
    match candle_core::backend::BackendStorage::dtype(storage) {
        DType::F32 => of::<f32>(storage, start),
        DType::I64 => of::<i64>(storage, start),
        other => candle_core::bail!("a kernel needs tensors of f32 or i64, found {other:?}"),
    }
}

/// Memory of one value on the device of `storage`.
pub(super) fn placeholder(storage: &CudaStorage) -> Result<CudaStorage> {
    let device = storage.device.clone();
    Ok(f32::wrap_cuda_slice(device.alloc_zeros::<f32>(1)?, device))
}

/// Memory of a tensor as an argument of cuDNN.
struct TensorMemory {
    address: u64,
    len: usize,
    stream: Arc<CudaStream>,
}

impl DeviceSlice<f32> for TensorMemory {
    fn len(&self) -> usize {
        self.len
    }

    fn stream(&self) -> &Arc<CudaStream> {
        &self.stream
    }
}

impl DevicePtr<f32> for TensorMemory {
    fn device_ptr<'a>(&'a self, _: &'a CudaStream) -> (u64, SyncOnDrop<'a>) {
        (self.address, SyncOnDrop::Record(None))
    }
}

impl DevicePtrMut<f32> for TensorMemory {
    fn device_ptr_mut<'a>(&'a mut self, _: &'a CudaStream) -> (u64, SyncOnDrop<'a>) {
        (self.address, SyncOnDrop::Record(None))
    }
}

/// Library handle of this thread, and its device. A handle is not destroyed, because the driver may end before the thread.
type Handle = Option<(DeviceId, ManuallyDrop<Arc<Cudnn>>)>;

thread_local!(static CUDNN: RefCell<Handle> = const { RefCell::new(None) });

fn handle(device: &CudaDevice) -> Result<Arc<Cudnn>> {
    CUDNN.with_borrow_mut(|known| {
        if let Some((_, cudnn)) = known.as_ref().filter(|(id, _)| *id == device.id()) {
            return Ok(Arc::clone(cudnn));
        }
        let cudnn = Cudnn::new(device.cuda_stream()).map_err(Error::wrap)?;
        *known = Some((device.id(), ManuallyDrop::new(cudnn.clone())));
        Ok(cudnn)
    })
}

/// Runs a pass of a convolution on the GPU of `values`; see [`super::launch::convolve`].
pub(super) fn convolve_on_gpu(
    pass: ConvolutionPass,
    sizes: &ConvolutionSizes,
    values: &Tensor,
    addresses: [u64; 3],
) -> Result<()> {
    ensure_f32(values)?;
    let device = values.device().as_cuda_device()?;
    run(pass, sizes, device, addresses).map_err(|error| Error::Msg(format!("cuDNN, {pass:?} of {sizes:?}: {error}")))
}

fn run(pass: ConvolutionPass, sizes: &ConvolutionSizes, device: &CudaDevice, addresses: [u64; 3]) -> Result<()> {
    let (cudnn, stream) = (handle(device)?, device.cuda_stream());
    let int = |n: usize| n as i32;
    let format = Format::CUDNN_TENSOR_NCHW;
    let x = cudnn.create_4d_tensor::<f32>(format, sizes.input.map(int)).map_err(Error::wrap)?;
    let y = cudnn.create_4d_tensor::<f32>(format, sizes.result.map(int)).map_err(Error::wrap)?;
    let w = cudnn.create_4d_filter::<f32>(format, sizes.weight.map(int)).map_err(Error::wrap)?;
    let [padding, stride] = [sizes.padding.map(int), sizes.stride.map(int)];
    let conv = cudnn.create_conv2d::<f32>(padding, stride, [1; 2], Mode::CUDNN_CROSS_CORRELATION);
    let conv = conv.map_err(Error::wrap)?;
    let shapes = [sizes.input, sizes.weight, sizes.result];
    let mut memory = std::array::from_fn::<_, 3, _>(|i| TensorMemory {
        address: addresses[i],
        len: shapes[i].iter().product(),
        stream: stream.clone(),
    });
    let [of_x, of_w, of_y] = &mut memory;
    // SAFETY: cuDNN writes the memory before it reads it.
    let workspace = |n: std::result::Result<usize, CudnnError>| match n.map_err(Error::wrap)? {
        0 => Ok(None),
        n => Ok::<_, Error>(Some(unsafe { device.alloc::<u8>(n)? })),
    };
    match pass {
        ConvolutionPass::Forward => {
            let op = ConvForward { conv: &conv, x: &x, w: &w, y: &y };
            let algorithm = ForwardAlgorithm::CUDNN_CONVOLUTION_FWD_ALGO_IMPLICIT_PRECOMP_GEMM;
            let mut workspace = workspace(op.get_workspace_size(algorithm))?;
            // SAFETY: the addresses are those of contiguous tensors of these sizes, as the caller guarantees.
            unsafe { op.launch(algorithm, workspace.as_mut(), (1.0, 0.0), of_x, of_w, of_y) }
        }
        ConvolutionPass::InputGradient => {
            let op = ConvBackwardData { conv: &conv, dx: &x, w: &w, dy: &y };
            let algorithm = InputAlgorithm::CUDNN_CONVOLUTION_BWD_DATA_ALGO_1;
            let mut workspace = workspace(op.get_workspace_size(algorithm))?;
            // SAFETY: as above.
            unsafe { op.launch(algorithm, workspace.as_mut(), (1.0, 0.0), of_x, of_w, of_y) }
        }
        ConvolutionPass::WeightGradient => {
            let op = ConvBackwardFilter { conv: &conv, x: &x, dw: &w, dy: &y };
            let algorithm = WeightAlgorithm::CUDNN_CONVOLUTION_BWD_FILTER_ALGO_1;
            let mut workspace = workspace(op.get_workspace_size(algorithm))?;
            // SAFETY: as above.
            unsafe { op.launch(algorithm, workspace.as_mut(), (1.0, 1.0), of_x, of_w, of_y) }
        }
    }
    .map_err(Error::wrap)
}
