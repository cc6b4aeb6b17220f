//! Spaces of movement of fixed length, in which Frechet distances are taken: a linear basis and a learnt embedding.

pub mod basis;
pub mod embedding;
pub mod fixed_rate;
