//! Whether a network trains or evaluates.

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
