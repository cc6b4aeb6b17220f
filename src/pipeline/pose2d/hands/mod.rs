//! Hands of the speaker: `tracker` detects them from frame to frame, with `arm_search` where one is not at its
//! previous position; `visibility` decides which of the detected points are visible.

mod arm_search;
pub mod tracker;
pub mod visibility;

pub use tracker::{HandTracker, reject_implausible};
pub use visibility::VisibleHands;
