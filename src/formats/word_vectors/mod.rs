//! Word vectors in one file that is read row by row: a safetensors file with the tensors `vectors` [words, numbers] and
//! `words` (UTF-8, a line each). `glove` and `wink` make it from what is published; `table` looks words up.

pub mod glove;
pub mod table;
pub mod wink;
pub mod writer;

pub use table::WordVectors;
