//! Generation of motion from speech with a trained model.

pub mod generator;
pub mod model;
pub mod normalisation;
pub mod representation;
pub mod seq2seq;
pub mod trained;

pub use generator::GestureGenerator;
