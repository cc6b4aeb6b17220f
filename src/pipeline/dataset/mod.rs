//! Stage 5: everything of a speaker to a dataset.

pub mod outcome;
pub mod stage;
pub mod video;

pub use stage::NothingKept;
