//! The dataset of one speaker on disk: written by the shard stage, read back by training. A folder holds WebDataset
//! tar shards (`train-000000.tar`, ...), `info.json` (what the numbers mean), `stats.json` (what they are like) and
//! `index.json` (where each sample lies, and its hash).
//!
//! A sample is an interval, continuous motion with its sound; windows are drawn when reading (`windows`). The way of
//! a sample: `sample` (members) -> `shard` (tar) -> `write` (splits, statistics, index); back: `read` -> `windows`.
//! Sound and motion meet by time in `sync`, nowhere else.

pub mod bones;
pub mod index;
pub mod info;
pub mod npy;
pub mod read;
pub mod sample;
pub mod shard;
pub mod split;
mod stage;
pub mod stats;
pub mod sync;
mod video;
pub mod wav;
pub mod windows;
pub mod write;

pub use read::Dataset;
pub use sample::Sample;
pub use split::Split;
pub use stage::ShardStage;
pub use windows::Windows;
pub use write::write_dataset;

/// Version of the folder's layout; a reader refuses any other.
pub const SCHEMA: u32 = 1;
/// The window of the paper, in frames, and the stride of training windows: what statistics count.
pub const WINDOW_FRAMES: usize = 64;
pub const STRIDE_FRAMES: usize = 5;
