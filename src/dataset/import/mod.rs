//! Import of captured motion and its sound into a dataset: text clips of Rebol et al. (2021), TED Expressive, BVH with
//! sound, and WebDataset shards written by orator.
//!
//! Steps for a take: `find` (files) -> `mocap` (joints at the source's rate) -> `motion::resample` (the dataset's rate)
//! -> `take` (bones, sound, trimming; a sample or a rejection) -> `write` (the dataset). `shards` imports tar members
//! unchanged.

pub mod find;
pub mod genea;
pub mod shards;
pub mod source;
pub mod take;
pub mod unpack;
pub mod write;

pub use take::ImportedTake;
pub use write::{ImportPlan, Imported, import};
