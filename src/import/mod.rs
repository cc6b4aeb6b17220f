//! Bridges in: motion that others captured, with its sound, becomes a dataset of the same form as one made from
//! videos. Read are the authors' text clips, TED Expressive, BVH with sound, and WebDataset shards of our own.
//!
//! The way of a take: `find` (which files belong together) -> `captured` (`bvh`, `facing`, `ted`: joints in house order
//! and axes, at the source's rate) -> `in_time` (at the dataset's rate) -> `take` (bones, sound, the cut: a sample, or
//! a refusal) -> `write` (the dataset). Shards come in by `shards`, their members as they are.

pub mod bvh;
pub mod captured;
pub mod facing;
pub mod find;
pub mod in_time;
pub mod loose;
pub mod origin;
pub mod take;
pub mod ted;
pub mod transcript;
pub mod write;

pub use captured::Captured;
pub use take::Take;
pub use write::{Imported, Plan, import};
