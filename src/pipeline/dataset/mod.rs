//! Stage 6: the dataset of a speaker. `stage` -> `division` (assignment of videos or blocks to splits) -> `run` (writes
//! the videos in turn, read by `video`) -> `outcome`. `persons` compares the persons in the videos.

pub mod division;
pub mod outcome;
pub mod persons;
pub mod run;
pub mod stage;
pub mod video;

pub use stage::NothingAccepted;
