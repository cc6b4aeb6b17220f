//! Functions of CUDA that candle calls, as jumps to addresses that `libraries` sets. candle links the libraries of
//! CUDA, and a program linked with them does not start where one is missing; with these symbols it is linked with none.
//! The linker reports a function that is called but not listed here as an undefined symbol.

use std::arch::global_asm;
use std::ffi::c_void;
use std::sync::atomic::AtomicPtr;

/// A shared library, and the names and addresses of its functions.
pub(super) struct CudaLibrary {
    /// File name with the major version.
    pub(super) file: &'static str,
    pub(super) functions: &'static [(&'static str, &'static AtomicPtr<c_void>)],
}

/// Address of a function that is called although its library was not loaded, or that no library has.
extern "C" fn not_loaded() {
    std::process::abort();
}

macro_rules! libraries {
    ($($file:literal: $($function:ident)*;)*) => {
        #[allow(non_upper_case_globals)]
        mod addresses {
            use super::{AtomicPtr, c_void, not_loaded};
            $($(pub(super) static $function: AtomicPtr<c_void> = AtomicPtr::new(not_loaded as *mut c_void);)*)*
        }
        $($(global_asm!(
            ".pushsection .text.cuda, \"ax\", @progbits",
            concat!(".globl ", stringify!($function)),
            concat!(".hidden ", stringify!($function)),
            concat!(".type ", stringify!($function), ", @function"),
            concat!(stringify!($function), ":"),
            "jmp qword ptr [rip + {address}]",
            ".popsection",
            address = sym addresses::$function,
        );)*)*
        pub(super) const LIBRARIES: &[CudaLibrary] = &[
            $(CudaLibrary { file: $file, functions: &[$((stringify!($function), &addresses::$function)),*] }),*
        ];
    };
}

libraries! {
    "libcuda.so.1":
        cuCtxDestroy_v2 cuCtxGetCurrent cuCtxSetCurrent cuDeviceGet cuDeviceGetAttribute cuDeviceGetCount
        cuDeviceGetDefaultMemPool cuDeviceGetName cuDevicePrimaryCtxRelease_v2 cuDevicePrimaryCtxRetain
        cuDeviceTotalMem_v2 cuDriverGetVersion cuEventCreate cuEventDestroy_v2 cuEventRecord cuGetErrorString
        cuInit cuLaunchKernel cuMemAllocAsync cuMemAlloc_v2 cuMemFreeAsync cuMemFree_v2 cuMemPoolGetAttribute
        cuMemPoolSetAttribute cuMemcpyDtoDAsync_v2 cuMemcpyDtoHAsync_v2 cuMemcpyHtoDAsync_v2 cuMemcpyPeerAsync
        cuMemsetD8Async cuModuleGetFunction cuModuleLoad cuModuleLoadData cuModuleUnload cuStreamDestroy_v2
        cuStreamIsCapturing cuStreamSynchronize cuStreamWaitEvent;
    "libcublas.so.13":
        cublasCreate_v2 cublasDestroy_v2 cublasDgemmStridedBatched cublasGemmStridedBatchedEx cublasSetStream_v2;
    "libcudnn.so.9":
        cudnnConvolutionBackwardData cudnnConvolutionBackwardFilter cudnnConvolutionForward cudnnCreate
        cudnnCreateConvolutionDescriptor cudnnCreateFilterDescriptor cudnnCreateTensorDescriptor cudnnDestroy
        cudnnDestroyConvolutionDescriptor cudnnDestroyFilterDescriptor cudnnDestroyTensorDescriptor
        cudnnGetConvolutionBackwardDataWorkspaceSize cudnnGetConvolutionBackwardFilterWorkspaceSize
        cudnnGetConvolutionForwardAlgorithm_v7 cudnnGetConvolutionForwardWorkspaceSize
        cudnnSetConvolution2dDescriptor cudnnSetFilter4dDescriptor cudnnSetStream cudnnSetTensor4dDescriptor
        cudnnSetTensor4dDescriptorEx;
    "libcurand.so.10":
        curandCreateGenerator curandDestroyGenerator curandGenerateNormal curandGenerateNormalDouble
        curandGenerateUniform curandGenerateUniformDouble curandSetPseudoRandomGeneratorSeed curandSetStream;
}
