//! Generation of motion from speech with a trained model.

pub mod generator;
pub mod mel_stream;
pub mod model;
pub mod normalisation;
pub mod representation;
pub mod seq2seq;
pub mod trained;
pub mod variant;

pub use generator::GestureGenerator;
