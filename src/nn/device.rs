//! Where the numbers of a network live: the CPU, or the first NVIDIA card where the program was built for one.

use anyhow::Result;
#[cfg(not(feature = "cuda"))]
use anyhow::bail;
use candle_core::Device;
use candle_core::Tensor;

/// The CPU, or the first NVIDIA card. Errors, with what to do: the program was built without CUDA, there is no card.
pub fn open(on_card: bool) -> Result<Device> {
    if on_card { cuda() } else { Ok(Device::Cpu) }
}

#[cfg(feature = "cuda")]
fn cuda() -> Result<Device> {
    use anyhow::Context as _;
    Device::new_cuda(0).context("the first NVIDIA card does not answer; with gan.device = \"cpu\" none is needed")
}

#[cfg(not(feature = "cuda"))]
fn cuda() -> Result<Device> {
    bail!(
        "this program was built without CUDA: build it with `cargo build --release --features cuda`, or set gan.device = \
         \"cpu\""
    )
}

/// Whether the tensor lives where this room's own operators do not run.
pub fn needs_fallback(x: &Tensor) -> bool {
    !x.device().is_cpu()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_had_is_said() {
        assert!(open(false).unwrap().is_cpu());
        #[cfg(not(feature = "cuda"))]
        assert!(open(true).unwrap_err().to_string().contains("--features cuda"));
    }
}
