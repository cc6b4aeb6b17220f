//! What the forward pass of an operator leaves for its backward pass.

use candle_core::Result;
use std::any::Any;
use std::sync::OnceLock;

/// Numbers by pieces of the batch, written once.
#[derive(Default)]
pub struct SavedPieces(OnceLock<Box<dyn Any + Send + Sync>>);

impl SavedPieces {
    pub fn put<T: Send + Sync + 'static>(&self, pieces: Vec<Vec<T>>) {
        let _ = self.0.set(Box::new(pieces));
    }

    /// Errors when the forward pass has left nothing.
    pub fn get<T: 'static>(&self) -> Result<&[Vec<T>]> {
        match self.0.get().and_then(|pieces| pieces.downcast_ref::<Vec<Vec<T>>>()) {
            Some(pieces) => Ok(pieces),
            None => candle_core::bail!("no forward pass has been made for this backward pass"),
        }
    }
}
