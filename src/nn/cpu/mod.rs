//! CPU kernels of the operators: direct convolution over packed weights, weight gradients, channel statistics,
//! row-wise loops of recurrent layers and transformers, and their thread pools.
//!
//! # Threads of the program
//!
//! | pool | threads | for |
//! |---|---|---|
//! | rayon's global pool | one per core | work that is split once: passes of the lifters, matrix products, metrics, pictures. The default everywhere; idle threads sleep |
//! | [`spin_pool`] | one per core, spinning | a training or generation of the GAN and the sequence networks: hundreds of small parallel loops a step, between which sleeping threads would wake too late. Alive only inside `with_spinning_workers`; without a pool its functions run on rayon |
//! | worker pool of a run (`orator_base::stage::parts`) | `--jobs` | whole units of the pipeline (videos) and the parts of a long one; each worker calls FFmpeg, OpenCV and ONNX Runtime, the latter with one thread |
//! | workers of a cluster (`orator_cluster`) | one process each, on any machine | units of one work folder; inside each process the three above |
//!
//! Results do not depend on which thread runs a task: work is cut into pieces of fixed size, and each sum has one order.
//! Parallel loops are not nested, and `gemm` is always called with one thread.

pub mod axis;
pub mod channel_stats;
pub mod direct_conv;
pub mod frames;
pub mod kernel;
pub mod packed_matrix;
pub mod spin_pool;
pub mod tensor;
pub mod transformer;
pub mod vectorised;
pub mod weight_gradient;
pub mod winograd;
pub mod winograd_filter;
