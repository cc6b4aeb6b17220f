//! Word vectors in one file that is read row by row: a safetensors file with the tensors `vectors` [words, dim] and
//! `words` (UTF-8, one per line). `glove` and `wink` convert published vectors to it; `table` looks words up.

pub mod glove;
pub mod table;
pub mod wink;
pub mod writer;

pub use table::WordVectors;
