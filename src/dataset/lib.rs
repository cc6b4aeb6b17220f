//! Configuration, and the dataset of one speaker on disk. Its folder contains WebDataset tar shards of each video
//! (`train-<video>-0000.tar`, ...), `videos/` (an entry per video), and common files assembled from the entries:
//! `info.json`, `stats.json`, `index.jsonl`, `ledger.jsonl`, `leakage.json`, `README.md`, `checksums.b3`. A sample is
//! an interval of continuous motion with its sound; training draws windows from it. Writing: `sample` -> `write::tar`
//! -> `write::entry` -> `write::assemble`; reading: `read`; splits: `split`, `shared_sound`; checks: `verify`.

pub mod bones;
pub mod card;
pub mod config;
pub mod decisions;
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
pub mod words;
pub mod write;

pub use layout::{CHECKSUMS, INDEX, INFO, LEAKAGE, LEDGER, README, SCHEMA, STATS, STRIDE_FRAMES, WINDOW_FRAMES};
pub(crate) use layout::{file_name, pretty, read_json};
pub use read::Dataset;
pub use sample::Sample;
pub use split::Split;
