//! Bridges in: motion that others captured, with its sound, becomes a dataset of the same form as one made from
//! videos. Read are the authors' text clips, TED Expressive, BVH with sound, and WebDataset shards of our own.
//!
//! The way of a take: `find` (which files belong together) -> `captured` (`bvh`, `facing`, `ted`: joints in house order
//! and axes, at the source's rate) -> `in_time` (at the dataset's rate) -> `take` (bones, sound, the cut: a sample, or
//! a refusal) -> `write` (the dataset). Shards come in by `shards`, their members as they are.

pub mod find;
pub mod plan;
pub mod shards;
pub mod source;
pub mod take;
pub mod transcript;
pub mod write;

pub use super::import::plan::ImportPlan;
pub use take::ImportedTake;
pub use write::Imported;
pub use write::import;
