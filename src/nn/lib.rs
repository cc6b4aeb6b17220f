//! Networks and operators: tensors in, tensors out. `weights` reads and writes weight files. Optimisers are elsewhere.
//!
//! candle's operators are used only where finite differences confirm their gradients (`tests/it/train/operators.rs`
//! lists them and rejects the others); convolution, batch norm and recurrent layers are implemented here. The layers
//! of the lifters are channels first; those of the GAN (`gan::generator`) are channels last, which avoids unfolding.

pub mod cpu;
#[cfg(feature = "cuda")]
pub mod cuda;
pub mod device;
pub mod gan;
pub mod gpu;
pub mod lifter;
pub mod motion_encoder;
pub mod ops;
pub mod params;
pub mod seq2seq;
pub mod weights;

pub use ops::dropout::Mode;
