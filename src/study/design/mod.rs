//! Who sees what in which order: clips shared out to tasks, conditions and sides balanced over the sessions, attention
//! checks among the trials.

mod clip_deck;
mod clip_needs;
mod design;
mod designer;
mod latin_square;
mod task_design;

pub use clip_needs::ClipNeeds;
pub use design::{DesignedStudy, design};
pub use task_design::{TaskBalance, right_response};
