//! NVIDIA GPUs, in builds with the feature `cuda`: the program starts without a driver and without the libraries of
//! CUDA, and loads them when it opens a GPU.

mod functions;
pub mod gpu;
pub mod libraries;
