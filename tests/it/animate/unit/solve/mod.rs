//! Tests of single modules of `orator_avatar::animate::solve`.

mod roll;
mod smoothing;
