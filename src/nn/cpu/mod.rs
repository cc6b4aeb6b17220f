//! Kernels of the operators on a processor: direct convolution over packed weights, weight gradients, channel
//! statistics, and the threads that share them.

pub mod axis;
pub mod channel_stats;
pub mod direct_conv;
pub mod kernel;
pub mod packed_weights;
pub mod tensor;
pub mod thread_team;
pub mod weight_gradient;
