//! The optimiser: Adam with a fused CPU kernel, and its fallback for devices without that kernel.

pub mod adam;
pub mod adam_fallback;
