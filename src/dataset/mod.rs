//! Dataset of one speaker on disk. A folder holds WebDataset tar shards of each video (`train-<video>-0000.tar`, ...),
//! `videos/` (an entry for each video), and common files assembled from the entries: `info.json`, `stats.json`,
//! `index.jsonl`, `ledger.jsonl`, `leakage.json`, `README.md`, `checksums.b3`. A sample is an interval of continuous
//! motion with its sound; training draws windows from it. Writing: `sample` -> `write::tar` -> `write::part` ->
//! `write::assemble`; reading: `read`; splits: `split`, `shared_sound`; checks: `verify`.

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
