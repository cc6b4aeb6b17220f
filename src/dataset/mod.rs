//! The dataset of one speaker on disk: written by the dataset stage, read back by training. A folder holds WebDataset
//! tar shards of each video (`train-<video>-0000.tar`, ...), `videos/` (what is known of each video), and the files put
//! together from these: `info.json` (what the numbers mean), `stats.json` (what they are like), `index.jsonl` (where each
//! sample lies), `ledger.jsonl` (what became of every second), `leakage.json`, the card `README.md`, `checksums.b3`.
//!
//! A sample is an interval, continuous motion with its sound; windows are drawn when training (`train::examples`). The
//! way of a sample: `video` (cut) -> `sample` (members) -> `shard` (tar) -> `part` (a video) -> `assemble`; back: `read`.
//! `split` and `shared_sound` decide where a video goes, `verify` checks all of it. Sound and motion meet by time in
//! `sync`, nowhere else.

pub mod bones;
pub mod card;
pub mod forget;
pub mod import;
pub mod index;
pub mod info;
pub mod joint_stats;
pub mod layout;
pub mod leakage;
pub mod read;
pub mod sample;
pub mod shared_sound;
pub mod split;
pub mod stats;
pub mod verify;
pub mod write;

pub use layout::CHECKSUMS;
pub use layout::INDEX;
pub use layout::INFO;
pub use layout::LEAKAGE;
pub use layout::LEDGER;
pub use layout::README;
pub use layout::SCHEMA;
pub use layout::STATS;
pub use layout::STRIDE_FRAMES;
pub use layout::WINDOW_FRAMES;
pub use read::Dataset;
pub use sample::Sample;
pub use split::Split;
pub use write::writer::write_dataset;
