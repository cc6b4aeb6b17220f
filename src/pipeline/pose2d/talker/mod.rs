//! Active speaker detection (`[pose2d] follow = "speaking"`), run before pose estimation: `search` measures the mouths
//! of all people in a shot, `choice` compares them with the voice, `path` is the path of the chosen person.

pub mod choice;
pub mod path;
pub mod search;

pub use path::TalkerPath;
pub use search::TalkerSearch;
