//! Kernels of the operators on a processor: direct convolution over packed weights, weight gradients, channel
//! statistics, row-wise work of recurrent layers, and the threads that share them.

pub mod axis;
pub mod channel_stats;
pub mod direct_conv;
pub mod exponential;
pub mod frames;
pub mod kernel;
pub mod packed_matrix;
pub mod packed_weights;
pub mod tensor;
pub mod thread_team;
pub mod vectorised;
pub mod weight_gradient;
