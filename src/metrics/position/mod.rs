//! Metrics of where joints are: L1, MPJPE, Procrustes-aligned MPJPE, PCK, acceleration error.

pub mod acceleration;
pub mod l1;
pub mod mpjpe;
pub mod p_mpjpe;
pub mod pck;
