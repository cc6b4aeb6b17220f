//! Networks of the GAN and their training on a GPU: own kernels (`kernels.cu`, `training.cu`) and convolutions of cuDNN,
//! with channels first. `launch` runs a kernel, `layer` a convolution with its normalisation, `passes` complete networks
//! as one operation of candle each, `gradients` collects the gradients of all parameters in one tensor. Tests run the
//! same code on the CPU, with the kernels compiled for it ([`launch::with_executor`]).

#[cfg(feature = "cuda")]
mod cuda;
pub mod frames;
pub mod gradients;
pub mod launch;
pub mod layer;
pub mod passes;
pub mod poses;
