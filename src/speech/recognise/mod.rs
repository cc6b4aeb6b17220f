//! Recognition of sound of any length.

mod recogniser;
mod segments;

pub use recogniser::{Recogniser, RecogniserOptions, SampleSource};
