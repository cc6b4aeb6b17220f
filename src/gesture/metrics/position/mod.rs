//! Metrics of joint positions: L1, MPJPE, Procrustes-aligned MPJPE, PCK, acceleration error.

pub mod errors;
pub mod pck;
