//! Hands of the speaker: `tracker` detects them from frame to frame, `visibility` decides which of the detected points
//! are visible.

pub mod tracker;
pub mod visibility;

pub use tracker::{HandTracker, reject_implausible};
pub use visibility::VisibleHands;
