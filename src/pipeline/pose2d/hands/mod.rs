//! Both hands of the speaker: `tracker` finds them from frame to frame, `visibility` decides which of the found points are visible.

pub mod tracker;
pub mod visibility;

pub use tracker::{HandTracker, guard};
pub use visibility::SeenHands;
