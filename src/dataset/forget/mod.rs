//! Forgetting a video: everything derived from it is removed, the dataset is assembled from the other videos, and a
//! search proves that nothing is left.
//!
//! Steps: `known` (which video) -> `removal` (what is removed, in an order that survives a kill) -> `dataset` (the
//! dataset without the video) -> `search` (the proof).

pub mod dataset;
pub mod known;
pub mod removal;
pub mod search;

pub use known::KnownVideo;
pub use removal::Removal;
