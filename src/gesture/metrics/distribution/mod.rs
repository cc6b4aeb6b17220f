//! Metrics of distributions: Frechet distances, diversity, distances of pairs.

pub mod diversity;
pub mod frechet;
pub mod frechet_metrics;
pub mod moments;
