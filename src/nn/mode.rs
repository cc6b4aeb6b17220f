//! Network architectures and the operators they are made of: tensors in, tensors out. No files, no optimiser.
//!
//! candle's own operators are used only where finite differences proved their gradients (`tests/it/operators.rs`
//! holds the list, and keeps the others out); convolution and batch norm are this room's. The lifters' layers work
//! channels first; generator and discriminator (`conv_block`) channels last, where nothing needs to be unfolded.

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
