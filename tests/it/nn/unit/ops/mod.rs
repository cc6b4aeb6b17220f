//! Tests of single modules of `orator_nn::ops`.

mod affine;
mod batch_norm;
mod conv1d;
mod resize;
