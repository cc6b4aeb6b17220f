//! Stage 5: everything of a speaker to a dataset. `stage` -> `division` (which video, or which block of it, is in which
//! split) -> `run` (one video after the other, read by `video`) -> `outcome`. `people` compares who is seen in the videos,
//! `faces` draws them.

pub mod division;
pub mod faces;
pub mod outcome;
pub mod people;
pub mod run;
pub mod stage;
pub mod video;

pub use stage::NothingKept;
