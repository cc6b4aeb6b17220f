//! Decisions of users about ranges of videos, which override those of the stages: their meaning (`decision`), the file
//! `decisions.toml` beside the configuration (`file`), and the keypoints with hands exchanged (`hands`).

pub mod decision;
pub mod file;
pub mod hands;

pub use decision::{Decision, DecisionAction, MAX_CHARS, counts, of_unit, record};
pub use file::{FILE_NAME, add, attach, path, read, remove, time_text};
pub use hands::{read_keypoints, swapped};
