//! Network architectures and the operators they are made of: tensors in, tensors out. No files, no optimiser.
//!
//! candle's own operators are used only where finite differences proved their gradients (`tests/it/operators.rs`
//! holds the list, and keeps the others out); convolution and batch norm are this room's. The lifters' layers work
//! channels first; generator and discriminator (`conv_block`) channels last, where nothing needs to be unfolded.

pub mod batch_norm;
pub mod body_lifter;
pub mod chunks;
pub mod composed;
pub mod conv;
pub mod conv1d;
pub mod conv2d;
pub mod conv3x3;
pub mod conv_axis;
pub mod conv_block;
pub mod conv_norm;
pub mod conv_panels;
pub mod conv_weight;
pub mod cpu;
pub mod device;
pub mod discriminator;
pub mod dropout;
pub mod finite_difference;
pub mod hand_lifter;
pub mod heatmap_lifter;
pub mod kernel;
pub mod linear;
pub mod motion_encoder;
pub mod params;
pub mod resize;
pub mod rows;
pub mod team;
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
