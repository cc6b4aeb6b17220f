//! Who of several people speaks (`[pose2d] follow = "speaking"`), found before the keypoints are: `search` sees the mouths
//! of everybody in a shot, `choice` holds them against the voice, `path` is the way of the one who was chosen.

pub mod choice;
pub mod path;
pub mod search;

pub use path::TalkerPath;
pub use search::TalkerSearch;
