//! Times of tokens and words from the attention of the decoder to the sound, and alignment of a given text.

pub(crate) mod token_times;
pub(crate) mod warping;
pub(crate) mod words;
