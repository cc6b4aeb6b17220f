//! Times of tokens and words from the attention of the decoder to the sound, and alignment of a given text.

mod matching;
mod text;
pub(crate) mod token_times;
mod warping;
pub(crate) mod word_bounds;
pub(crate) mod words;
