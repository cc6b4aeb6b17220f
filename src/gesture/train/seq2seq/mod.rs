//! Training of FineMotion's sequence-to-sequence networks (`nn::seq2seq`). Data flow: `source` (a dataset, or
//! `captures`) -> `segments` -> `step` (network, `losses`, optimiser) -> `validate`; `train` is the loop.

pub mod captures;
pub mod losses;
pub mod reading;
pub mod segments;
pub mod source;
pub mod step;
pub mod train;
pub mod validate;
