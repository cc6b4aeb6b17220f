//! Files and constants of the dataset's folder.

/// Version of the folder's layout; a reader refuses any other.
pub const SCHEMA: u32 = 2;
/// Window length of Rebol et al. (2021) and stride of training windows, in frames, which the statistics count.
pub const WINDOW_FRAMES: usize = 64;
pub const STRIDE_FRAMES: usize = 5;

/// Names of the files that describe all videos.
pub const INFO: &str = "info.json";
pub const STATS: &str = "stats.json";
pub const INDEX: &str = "index.jsonl";
pub const LEDGER: &str = "ledger.jsonl";
pub const LEAKAGE: &str = "leakage.json";
pub const README: &str = "README.md";
pub const CHECKSUMS: &str = "checksums.b3";
