//! Stage 5: everything of a speaker to a dataset. `stage` -> `division` (which video, or which block of it, is in which
//! split) -> `run` (one video after the other, read by `video`) -> `outcome`.

pub mod division;
pub mod outcome;
pub mod run;
pub mod stage;
pub mod video;

pub use stage::NothingKept;
