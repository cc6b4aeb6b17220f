//! The device that the networks of a command are computed on: opened once, and handed down as a [`Device`].

#[cfg(feature = "cuda")]
use crate::cuda::gpu::open as open_gpu;
use anyhow::{Result, anyhow, bail};
pub use candle_core::Device;
use candle_core::utils::cuda_is_available;
use orator_base::types::device::DeviceChoice;

/// Opens the chosen device. `cpu_only` returns why the networks of the command run on the CPU only, if they do; it is not
/// called for the CPU. For [`DeviceChoice::Auto`] also returns which device was chosen, and why if it is the CPU.
///
/// # Errors
/// A GPU is chosen explicitly, and the networks run on the CPU only, the program was built without CUDA, there is no such
/// GPU, or a library is missing.
pub fn open<'a>(choice: DeviceChoice, cpu_only: impl FnOnce() -> Option<&'a str>) -> Result<(Device, Option<String>)> {
    let number = match choice {
        DeviceChoice::Cpu => return Ok((Device::Cpu, None)),
        DeviceChoice::Auto => 0,
        DeviceChoice::Cuda(number) => number,
    };
    match (cpu_only().map_or_else(|| open_gpu(number), |reason| Err(anyhow!("{reason}"))), choice) {
        (Ok(gpu), DeviceChoice::Auto) => Ok((gpu, Some(format!("GPU {number}")))),
        (Ok(gpu), _) => Ok((gpu, None)),
        (Err(cause), DeviceChoice::Auto) => Ok((Device::Cpu, Some(format!("CPU ({cause})")))),
        (Err(cause), _) => {
            bail!("cannot use the device {choice}: {cause}; give --device cpu, or set work.device = \"cpu\"")
        }
    }
}

/// Whether the program was built with CUDA.
pub fn has_cuda() -> bool {
    cuda_is_available()
}

#[cfg(not(feature = "cuda"))]
fn open_gpu(_number: usize) -> Result<Device> {
    bail!("this program has no CUDA: build it with `cargo build --release --features cuda` (`orator guide gpu`)")
}
