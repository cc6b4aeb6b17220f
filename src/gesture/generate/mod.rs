//! Generation of motion from speech with a trained model.

pub mod generator;
pub mod live;
pub mod model;
pub mod normalisation;
pub mod representation;
pub mod seq2seq;
pub mod trained;
pub mod word_input;

pub use generator::GestureGenerator;
