//! The optimiser: Adam with fused kernels, for the CPU and for a GPU.

pub mod adam;
mod device_adam;
