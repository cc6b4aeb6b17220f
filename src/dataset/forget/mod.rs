//! Forgetting a video: everything that was derived from it goes, the dataset is put together from the other videos, and
//! a search proves that nothing is left.
//!
//! The way: `known` (which videos there are, and which one is meant) -> `removal` (what goes, in an order that a kill
//! cannot turn into a dataset that looks whole and is not) -> `dataset` (without the video) -> `search` (the proof).

pub mod dataset;
pub mod known;
pub mod removal;
pub mod search;

pub use known::KnownVideo;
pub use removal::Removal;
