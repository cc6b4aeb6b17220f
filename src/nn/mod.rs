//! Network architectures and the operators they are made of: tensors in, tensors out. No files, no optimiser.
//!
//! candle's own operators are used only where finite differences proved their gradients (`tests/it/operators.rs`
//! holds the list, and keeps the others out); convolution over time and batch norm are this room's.

pub mod batch_norm;
pub mod body_lifter;
pub mod chunks;
pub mod composed;
pub mod conv1d;
pub mod conv3x3;
pub mod conv_block;
pub mod cpu;
pub mod discriminator;
pub mod dropout;
pub mod finite_difference;
pub mod hand_lifter;
pub mod heatmap_lifter;
pub mod linear;
pub mod params;
pub mod resize;
pub mod temporal_lifter;
pub mod unet;

/// Whether a forward pass trains (batch statistics, dropout masks drawn from the generator) or evaluates.
pub enum Mode<'a> {
    Train(&'a mut rand_chacha::ChaCha8Rng),
    Eval,
}

impl Mode<'_> {
    pub fn trains(&self) -> bool {
        matches!(self, Mode::Train(_))
    }
}
