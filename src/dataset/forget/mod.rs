//! Forgetting a video: everything derived from it is removed, the dataset is assembled again from the other videos, and
//! a search verifies that nothing is left.
//!
//! Steps: `known` (selects the video) -> `removal` (removes its data, in an order that survives a kill) -> `dataset`
//! (rebuilds the dataset without the video) -> `search` (verifies the result).

pub mod dataset;
pub mod known;
pub mod removal;
pub mod search;

pub use known::KnownVideo;
pub use removal::Removal;
