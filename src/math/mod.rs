//! Vectors, rotations, Procrustes alignment, eigenvalues and filters. Knows no body and no file.

pub mod eigen;
pub mod gaussian;
pub mod one_euro;
pub mod procrustes;
pub mod rotation;
pub mod savitzky_golay;
pub mod vec3;
