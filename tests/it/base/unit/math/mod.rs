//! Tests of single modules of `orator_base::math`.

mod local_fit;
mod procrustes;
mod runs;
mod savitzky_golay;
