//! The optimiser: Adam over all parameters at once, and its form for devices without the kernels.

pub mod adam;
pub mod adam_fallback;
