//! Operators with forward and backward passes: convolutions, batch norm, linear, dropout, resize, recurrent layers; `operator` is how the
//! framework runs them, `fallback` what runs on a device without the kernels of `nn::cpu`, `gradcheck` the finite
//! differences that prove the gradients.

pub mod affine;
pub mod batch_norm;
pub mod conv1d;
pub mod conv2d;
pub mod conv_norm;
pub mod dropout;
pub mod fallback;
pub mod gradcheck;
pub mod operator;
pub mod recurrent;
pub mod resize;
