//! Division of a speaker's videos into splits: `blocks` (a video in blocks of time),
//! `assign` (all videos), `record` (what stays when others are added, and why).

pub mod assign;
pub mod blocks;
pub mod record;

pub use assign::{Assignment, SplitPlan, Unassigned, assign};
pub use orator_base::types::split::{Split, TimeBlock};
pub use record::{RecordedSplit, SplitBy, SplitRecord, SplitRule};
