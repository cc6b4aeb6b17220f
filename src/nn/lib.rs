//! Network architectures and the operators they are made of: tensors in, tensors out. No files, no optimiser.
//!
//! candle's own operators are used only where finite differences proved their gradients (`tests/it/operators.rs`
//! holds the list, and keeps the others out); convolution and batch norm are this room's. The lifters' layers work
//! channels first; generator and discriminator (`conv_block`) channels last, where nothing needs to be unfolded.

pub mod cpu;
pub mod gan;
pub mod lifter;
pub mod motion_encoder;
pub mod ops;
pub mod params;
pub mod seq2seq;

pub use ops::dropout::Mode;
