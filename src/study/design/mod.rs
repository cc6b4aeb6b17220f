//! Experimental design: clips are allocated to tasks, conditions and screen sides are balanced over the sessions, and
//! attention checks are inserted among the trials.

pub mod clip_scheduler;
mod design;
mod designer;
mod task_design;

pub use clip_scheduler::ClipNeeds;
pub use design::{DesignedStudy, design};
pub use task_design::{TaskBalance, right_response};
