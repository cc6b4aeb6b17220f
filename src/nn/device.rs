//! Where the numbers of a network live: the CPU, or the first NVIDIA card where the program was built for one.

use anyhow::{Result, bail};
use candle_core::Device;
use candle_core::Tensor;

/// `cpu` or `cuda`. Errors, saying what to do, on another name, when the program was built without CUDA, and when there
/// is no card.
pub fn named(name: &str) -> Result<Device> {
    match name {
        "cpu" => Ok(Device::Cpu),
        "cuda" => cuda(),
        _ => bail!("the device is `cpu` or `cuda`, not `{name}`"),
    }
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
pub fn needed(x: &Tensor) -> bool {
    !x.device().is_cpu()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_had_is_said() {
        assert!(named("cpu").unwrap().is_cpu());
        assert!(named("gpu").unwrap_err().to_string().contains("`cpu` or `cuda`"));
        #[cfg(not(feature = "cuda"))]
        assert!(named("cuda").unwrap_err().to_string().contains("--features cuda"));
    }
}
