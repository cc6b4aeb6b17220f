//! Recognition of sound of any length.

mod recogniser;
mod segments;

pub(crate) use recogniser::{EncodedWindow, RecognitionRequest};
pub use recogniser::{Recogniser, RecogniserOptions, SampleSource};
