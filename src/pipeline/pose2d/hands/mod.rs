//! Both hands of the speaker: `tracker` finds them from frame to frame, `sight` says what of the found points is seen.

pub mod sight;
pub mod tracker;

pub use sight::SeenHands;
pub use tracker::{HandTracker, guard};
