//! Feature spaces for windows of fixed length, for Frechet distances: a linear basis and a trained embedding.

pub mod basis;
pub mod embedding;
pub mod fixed_rate;
