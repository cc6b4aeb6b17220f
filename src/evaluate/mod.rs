//! How good what is trained is; no training here. `bodies` and `hands`: the lifters' errors on motion with known truth, any
//! captured file, seen by random cameras. `speaker`: a trained speaker on `held_out` intervals, beside other
//! `predictors`, each figure with its `bootstrap` interval.

pub mod bodies;
pub mod bootstrap;
pub mod hands;
pub mod held_out;
pub mod neighbour;
pub mod predictors;
pub mod speaker;
mod speaker_blocks;
pub mod speaker_text;
