//! Division of a speaker's videos into splits: `blocks` (time blocks of one video), `assign` (assignment of all
//! videos), `record` (stored assignments, which stay when videos are added).

pub mod assign;
pub mod blocks;
pub mod record;

pub use assign::{Assignment, SplitPlan, Unassigned, assign};
pub use orator_base::types::split::{Split, TimeBlock};
pub use record::{RecordedSplit, SplitBy, SplitRecord, SplitRule};
