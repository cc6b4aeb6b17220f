//! Weights and their metadata in one file: safetensors whose metadata holds one JSON object under `orator`. The bytes
//! are deterministic. `orator_nn::weights` reads the tensors.

use anyhow::Context;
use orator_base::input;
use safetensors::View;
use serde_json::Value;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Key of the JSON object in the safetensors metadata.
const METADATA: &str = "orator";
/// File name prefix of a training checkpoint, followed by its step.
const PREFIX: &str = "step-";

/// File contents for this metadata and these tensors.
pub fn to_bytes<V: View>(facts: &Value, tensors: impl IntoIterator<Item = (String, V)>) -> anyhow::Result<Vec<u8>> {
    // A single key: with more, the iteration order of the HashMap would change the bytes.
    let metadata = HashMap::from([(METADATA.to_owned(), serde_json::to_string(facts)?)]);
    Ok(safetensors::serialize(tensors, Some(metadata))?)
}

/// Metadata of a file, without its tensors. Errors name the file.
pub fn facts(path: &Path) -> anyhow::Result<Value> {
    read_with(path, facts_of)
}

/// Applies `parse` to the contents of a file. Errors name the file.
pub fn read_with<T>(path: &Path, parse: fn(&[u8]) -> anyhow::Result<T>) -> anyhow::Result<T> {
    let bytes = input::read(path, input::MAX_DATA).with_context(|| format!("cannot read {}", path.display()))?;
    parse(&bytes).with_context(|| format!("{} is not a checkpoint or weights file", path.display()))
}

/// Metadata in the contents of a file.
pub fn facts_of(bytes: &[u8]) -> anyhow::Result<Value> {
    let (_, header) = safetensors::SafeTensors::read_metadata(bytes)?;
    let facts = header.metadata().as_ref().and_then(|m| m.get(METADATA)).context("it has no metadata of orator")?;
    Ok(serde_json::from_str(facts)?)
}

/// Path of the checkpoint of `step` in the folder of a training run.
pub fn path(folder: &Path, step: usize) -> PathBuf {
    folder.join(format!("{PREFIX}{step:07}.safetensors"))
}

/// Checkpoints in a folder with their steps, oldest first; empty if the folder does not exist.
pub fn list(folder: &Path) -> anyhow::Result<Vec<(usize, PathBuf)>> {
    if !folder.exists() {
        return Ok(Vec::new());
    }
    let entries = std::fs::read_dir(folder).with_context(|| format!("cannot list {}", folder.display()))?;
    let mut found = Vec::new();
    for entry in entries {
        let path = entry?.path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let step = name.strip_prefix(PREFIX).and_then(|name| name.strip_suffix(".safetensors"));
        if let Some(Ok(step)) = step.map(str::parse) {
            found.push((step, path));
        }
    }
    found.sort();
    Ok(found)
}

/// Removes all but the newest `n_accepted` checkpoints; the newest one always remains.
pub fn prune(folder: &Path, n_accepted: usize) -> anyhow::Result<()> {
    let found = list(folder)?;
    let n_old = found.len().saturating_sub(n_accepted.max(1));
    for (_, path) in &found[..n_old] {
        std::fs::remove_file(path).with_context(|| format!("cannot remove the old checkpoint {}", path.display()))?;
    }
    Ok(())
}
