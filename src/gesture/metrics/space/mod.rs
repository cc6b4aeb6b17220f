//! Feature spaces for windows of fixed length, in which Frechet distances are computed: a linear basis and a trained
//! embedding.

pub mod basis;
pub mod embedding;
pub mod fixed_rate;
