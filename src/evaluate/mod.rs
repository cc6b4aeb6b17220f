//! How good what is trained is; no training here. `bodies` and `hands`: the lifters' errors on motion with known truth, any
//! captured file, seen by random cameras.
//!
//! Made motion beside the real one: `pairs` (which files belong together) -> `motion_file`, `hearing` -> `clips`; or
//! a dataset and a checkpoint by `held_out` and `speaker` -> `clips`. Then `baselines` (of `stills`, `neighbour`) make
//! what is measured beside it, `blocks` measure, `bootstrap` draws, and `table` holds all of it: shown by `text`, kept by
//! `result`, held against another by `compare`, and put into words by `verdict` and `words`.

pub mod baselines;
pub mod blocks;
pub mod bodies;
pub mod bootstrap;
pub mod clips;
pub mod compare;
pub mod hands;
pub mod hearing;
pub mod held_out;
pub mod motion_file;
pub mod neighbour;
pub mod pairs;
pub mod predictors;
pub mod result;
pub mod speaker;
pub mod stills;
pub mod table;
pub mod text;
pub mod verdict;
pub mod words;
