//! Who sees what in which order: clips shared out to tasks, conditions and sides balanced over the sessions, attention
//! checks among the trials.

mod balance;
mod clip_deck;
mod clip_needs;
mod comparison;
mod design;
mod designer;
mod latin_square;
mod task_design;

pub use balance::TaskBalance;
pub use clip_needs::ClipNeeds;
pub use comparison::right_response;
pub use design::{DesignedStudy, design};
