//! Vectors, rotations, Procrustes alignment, eigenvalues, filters, medians, quantiles, runs. Independent of bodies and
//! files.

pub mod cholesky;
pub mod eigen;
pub mod estimate;
pub mod gaussian;
pub mod local_fit;
pub mod order;
pub mod procrustes;
pub mod rotation;
pub mod runs;
pub mod savitzky_golay;
pub mod vec3;
