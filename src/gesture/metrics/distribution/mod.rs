//! Metrics of distributions: Frechet distances, diversity, pairwise distances.

pub mod frechet;
pub mod frechet_metrics;
pub mod moments;
