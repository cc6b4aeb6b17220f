//! File names and constants of the dataset folder, and reading and writing of its JSON files.

use anyhow::{Context, Result};
use orator_base::input;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// Version of the folder's layout; readers reject any other.
pub const SCHEMA: u32 = 2;
/// Window length that the statistics count, frames; as in Rebol et al. (2021).
pub const WINDOW_FRAMES: usize = 64;
/// Stride of training windows that the statistics count, frames.
pub const STRIDE_FRAMES: usize = 5;

/// Names of the common files, assembled from the entries of all videos.
pub const INFO: &str = "info.json";
pub const STATS: &str = "stats.json";
pub const INDEX: &str = "index.jsonl";
pub const LEDGER: &str = "ledger.jsonl";
pub const LEAKAGE: &str = "leakage.json";
pub const README: &str = "README.md";
pub const CHECKSUMS: &str = "checksums.b3";

/// Reads a JSON file of a dataset; the error names the file.
pub(crate) fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let bytes = input::read(path, input::MAX_TEXT).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_slice(&bytes)
        .with_context(|| format!("{} is not a valid file of a dataset: run the dataset stage again", path.display()))
}

/// Encodes as indented JSON with a trailing newline.
pub(crate) fn pretty(value: &impl Serialize) -> Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec_pretty(value)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// File name of a path, with invalid UTF-8 replaced.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
