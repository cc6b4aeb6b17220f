//! The dataset of one speaker on disk: written by the dataset stage, read back by training. A folder holds WebDataset
//! tar shards of each video (`train-<video>-0000.tar`, ...), `videos/` (what is known of each video), and the files put
//! together from these: `info.json` (what the numbers mean), `stats.json` (what they are like), `index.jsonl` (where each
//! sample lies), `ledger.jsonl` (what became of every second), `leakage.json`, the card `README.md`, `checksums.b3`.
//!
//! A sample is an interval, continuous motion with its sound; windows are drawn when training (`train::examples`). The
//! way of a sample: `video` (cut) -> `sample` (members) -> `shard` (tar) -> `part` (a video) -> `assemble`; back: `read`.
//! `split` and `shared_sound` decide where a video goes, `verify` checks all of it. Sound and motion meet by time in
//! `sync`, nowhere else.

/// Version of the folder's layout; a reader refuses any other.
pub const SCHEMA: u32 = 2;
/// The window of the paper, in frames, and the stride of training windows: what statistics count.
pub const WINDOW_FRAMES: usize = 64;
pub const STRIDE_FRAMES: usize = 5;

/// Names of the files that speak of all videos.
pub const INFO: &str = "info.json";
pub const STATS: &str = "stats.json";
pub const INDEX: &str = "index.jsonl";
pub const LEDGER: &str = "ledger.jsonl";
pub const LEAKAGE: &str = "leakage.json";
pub const README: &str = "README.md";
pub const CHECKSUMS: &str = "checksums.b3";
