//! Network architectures and the operators they are made of: tensors in, tensors out. `weights` reads and writes the files of
//! weights. No optimiser.
//!
//! candle's operators are used only where finite differences confirm their gradients (`tests/it/train/operators.rs` has
//! the list, and rejects the others); convolution, batch norm and recurrent layers are own ones. The layers of the lifters
//! work channels first; those of the GAN (`conv_block`) channels last, where nothing needs to be unfolded.

pub mod cpu;
pub mod gan;
pub mod lifter;
pub mod motion_encoder;
pub mod ops;
pub mod params;
pub mod seq2seq;
pub mod weights;

pub use ops::dropout::Mode;
