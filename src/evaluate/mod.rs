//! How good what is trained is; no training here. `bodies` and `hands`: the lifters' errors on motion with known truth, any
//! captured file, seen by random cameras.
//!
//! Made motion beside the real one: `pairs` (which files belong together) -> `motion_file`, `hearing` -> `clips`; or
//! a dataset and a checkpoint by `held_out` and `speaker` -> `clips`. Then `baselines` (of `stills`, `neighbour`) make
//! what is measured beside it, `blocks` measure, `bootstrap` draws, and `table` holds all of it: shown by `text`, kept by
//! `result`, held against another by `compare`, and put into words by `verdict` and `words`.

pub mod baseline;
pub mod clips;
pub mod lifter;
pub mod table;
pub mod verdict;
