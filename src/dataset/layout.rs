//! Files and constants of the dataset's folder, and how its JSON files are read and written.

use anyhow::{Context, Result};
use orator_base::input;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

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

/// Reads a JSON file of a dataset; errors name it.
pub(crate) fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let bytes = input::read(path, input::MOST_TEXT).with_context(|| format!("reading {}", path.display()))?;
    serde_json::from_slice(&bytes)
        .with_context(|| format!("{} is not as the dataset stage writes it; run the stage again", path.display()))
}

/// Indented JSON with a line feed at its end.
pub(crate) fn pretty(value: &impl Serialize) -> Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec_pretty(value)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// Last part of a path as text.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
