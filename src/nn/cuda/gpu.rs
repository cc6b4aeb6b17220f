//! NVIDIA GPUs: listed, opened, and their memory.

use super::libraries;
use anyhow::{Result, anyhow};
use candle_core::Device;
use candle_core::cuda_backend::cudarc::driver::{DriverError, result, sys};
use std::ffi::c_int;

/// Name, memory and supported version of CUDA of each GPU of this machine.
///
/// # Errors
/// A library is missing, or the driver does not work.
pub fn list() -> Result<Vec<String>> {
    libraries::load()?;
    let describe = |number| {
        let gpu = result::device::get(number)?;
        // SAFETY: `gpu` is a device of this driver.
        let memory = unsafe { result::device::total_mem(gpu) }? as f64 / f64::from(1 << 30);
        Ok(format!("{}, {memory:.0} GiB", result::device::get_name(gpu)?))
    };
    let listed = || -> Result<Vec<String>, DriverError> {
        result::init()?;
        let mut version = 0;
        // SAFETY: `version` is writable.
        unsafe { sys::cuDriverGetVersion(&raw mut version) }.result()?;
        let driver = format!("the driver supports CUDA {}.{}", version / 1000, version % 1000 / 10);
        (0..result::device::get_count()?).map(|number| Ok(format!("{}; {driver}", describe(number)?))).collect()
    };
    listed().map_err(failed)
}

/// Opens a GPU; numbers start at 0.
///
/// # Errors
/// A library is missing, or there is no such GPU.
pub fn open(number: usize) -> Result<Device> {
    libraries::load()?;
    let device = Device::new_cuda(number).map_err(|error| anyhow!("no usable NVIDIA GPU {number}: {error}"))?;
    // At every synchronisation, freed memory is given back to the system unless the pool keeps it.
    let (name, mut kept) = (sys::CUmemPool_attribute::CU_MEMPOOL_ATTR_RELEASE_THRESHOLD, u64::MAX);
    // SAFETY: the value of this attribute is a `u64`. A GPU without pools is only slower.
    let _ = pool(number).map(|pool| unsafe { result::mem_pool::set_attribute(pool, name, (&raw mut kept).cast()) });
    Ok(device)
}

/// Largest memory that tensors on an opened GPU have used, in bytes; without that of libraries and kernels.
///
/// # Errors
/// A library is missing, or the driver does not count it.
pub fn peak_memory(number: usize) -> Result<u64> {
    libraries::load()?;
    let (name, mut peak) = (sys::CUmemPool_attribute::CU_MEMPOOL_ATTR_USED_MEM_HIGH, 0u64);
    // SAFETY: the value of this attribute is a `u64`.
    let read =
        pool(number).and_then(|pool| unsafe { result::mem_pool::get_attribute(pool, name, (&raw mut peak).cast()) });
    read.map_err(failed)?;
    Ok(peak)
}

/// The pool from which tensors on a GPU are allocated.
fn pool(number: usize) -> Result<sys::CUmemoryPool, DriverError> {
    let gpu = result::device::get(c_int::try_from(number).unwrap_or(c_int::MAX))?;
    // SAFETY: `gpu` is a device of this driver.
    unsafe { result::device::get_default_mem_pool(gpu) }
}

fn failed(error: DriverError) -> anyhow::Error {
    anyhow!("the NVIDIA driver reports {error:?}; `nvidia-smi` must list the GPU")
}
