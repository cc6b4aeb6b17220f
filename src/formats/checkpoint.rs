//! Weights and everything beside them in one file: safetensors whose metadata holds one JSON object under `orator`.
//! Written atomically; the same contents give the same bytes.

use anyhow::{Context, ensure};
use candle_core::safetensors::Load;
use candle_core::{DType, Device, Tensor};
use orator_base::stage::workdir;
use serde_json::Value;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

/// The key of our JSON in the file's metadata.
const METADATA: &str = "orator";
/// Name of a training checkpoint's file for a step.
const PREFIX: &str = "step-";

/// Contents of a file: named tensors, and metadata as JSON.
pub struct Contents {
    pub facts: Value,
    pub tensors: BTreeMap<String, Tensor>,
}

impl Contents {
    /// The tensors whose names begin with `prefix`, without it.
    pub fn part(&self, prefix: &str) -> BTreeMap<String, Tensor> {
        let strip = |(name, tensor): (&String, &Tensor)| Some((name.strip_prefix(prefix)?.to_owned(), tensor.clone()));
        self.tensors.iter().filter_map(strip).collect()
    }

    /// Checks that a network of at least `least` weights may be in it, before memory is taken for one.
    pub fn expect_numbers(&self, least: usize) -> anyhow::Result<()> {
        let n_numbers: usize = self.tensors.values().map(Tensor::elem_count).sum();
        ensure!(least <= n_numbers, "its network has {least} weights or more, the file {n_numbers}");
        Ok(())
    }

    /// Adds tensors with `prefix` before their names.
    pub fn add(&mut self, prefix: &str, tensors: BTreeMap<String, Tensor>) {
        self.tensors.extend(tensors.into_iter().map(|(name, tensor)| (format!("{prefix}{name}"), tensor)));
    }

    /// The bytes of the file.
    pub fn to_bytes(&self) -> anyhow::Result<Vec<u8>> {
        // One key only: the order of a HashMap with more would change the bytes.
        let metadata = HashMap::from([(METADATA.to_owned(), serde_json::to_string(&self.facts)?)]);
        Ok(safetensors::serialize(&self.tensors, Some(metadata))?)
    }

    /// Parses the bytes that [`Contents::to_bytes`] gives.
    pub fn from_bytes(bytes: &[u8]) -> anyhow::Result<Self> {
        let facts = parse_facts(bytes)?;
        let file = safetensors::SafeTensors::deserialize(bytes)?;
        let load = |(name, view): (String, safetensors::tensor::TensorView)| {
            let tensor = view.load(&Device::Cpu)?;
            ensure!(
                is_finite(&tensor)?,
                "the tensor {name} holds a number that is not finite: it was damaged, or its training failed"
            );
            Ok((name, tensor))
        };
        let tensors = file.tensors().into_iter().map(load).collect::<anyhow::Result<_>>()?;
        Ok(Self { facts, tensors })
    }

    /// Writes the file atomically.
    pub fn write(&self, path: &Path) -> anyhow::Result<()> {
        workdir::write_file(path, &self.to_bytes()?)
    }

    /// Reads a file. Errors name it.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        read_with(path, Self::from_bytes)
    }
}

/// Facts of a file alone. Errors name it.
pub fn facts(path: &Path) -> anyhow::Result<Value> {
    read_with(path, parse_facts)
}

fn read_with<T>(path: &Path, parse: fn(&[u8]) -> anyhow::Result<T>) -> anyhow::Result<T> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read the weights {}", path.display()))?;
    parse(&bytes).with_context(|| format!("{} is not a checkpoint or weights file", path.display()))
}

fn parse_facts(bytes: &[u8]) -> anyhow::Result<Value> {
    let (_, header) = safetensors::SafeTensors::read_metadata(bytes)?;
    let facts = header.metadata().as_ref().and_then(|m| m.get(METADATA)).context("it was not written by orator")?;
    Ok(serde_json::from_str(facts)?)
}

fn is_finite(tensor: &Tensor) -> anyhow::Result<bool> {
    if !tensor.dtype().is_float() {
        return Ok(true);
    }
    let numbers = tensor.flatten_all()?.to_dtype(DType::F32)?.to_vec1::<f32>()?;
    Ok(numbers.iter().all(|number| number.is_finite()))
}

/// The checkpoint of `step` inside the folder of a training.
pub fn path(folder: &Path, step: usize) -> PathBuf {
    folder.join(format!("{PREFIX}{step:07}.safetensors"))
}

/// The checkpoints in a folder, oldest first, with their steps; none when there is no such folder.
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

/// Removes all but the newest `n_kept` checkpoints (at least one stays).
pub fn prune(folder: &Path, n_kept: usize) -> anyhow::Result<()> {
    let found = list(folder)?;
    let n_old = found.len().saturating_sub(n_kept.max(1));
    for (_, path) in &found[..n_old] {
        std::fs::remove_file(path).with_context(|| format!("cannot remove the old checkpoint {}", path.display()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn contents_come_back_and_bytes_repeat() -> anyhow::Result<()> {
        let folder = tempfile::tempdir()?;
        let mut contents = Contents { facts: json!({"step": 7, "kind": "test"}), tensors: BTreeMap::new() };
        let tensor = Tensor::new(&[[1f32, 2.0], [3.0, f32::MIN_POSITIVE]], &Device::Cpu)?;
        contents.add("net.", BTreeMap::from([("w".into(), tensor.clone()), ("a".into(), tensor.clone())]));
        let file = path(folder.path(), 7);
        contents.write(&file)?;
        let read = Contents::read(&file)?;
        assert_eq!(read.facts, contents.facts);
        assert_eq!(read.part("net.")["w"].to_vec2::<f32>()?, tensor.to_vec2::<f32>()?);
        assert_eq!(read.to_bytes()?, std::fs::read(&file)?);
        Ok(())
    }

    #[test]
    fn a_weight_that_is_no_number_is_named() -> anyhow::Result<()> {
        let folder = tempfile::tempdir()?;
        let file = path(folder.path(), 1);
        for wrong in [f32::NAN, f32::INFINITY] {
            let tensors = BTreeMap::from([("net.w".to_owned(), Tensor::new(&[1.0, wrong, 2.0], &Device::Cpu)?)]);
            Contents { facts: json!({}), tensors }.write(&file)?;
            let text = format!("{:#}", Contents::read(&file).err().context("it was read")?);
            assert!(text.contains("step-0000001.safetensors") && text.contains("net.w"), "{text}");
        }
        Ok(())
    }

    #[test]
    fn the_newest_are_kept() -> anyhow::Result<()> {
        let folder = tempfile::tempdir()?;
        for step in [100, 20, 3000] {
            std::fs::write(path(folder.path(), step), b"x")?;
        }
        std::fs::write(folder.path().join("best.safetensors"), b"x")?;
        prune(folder.path(), 2)?;
        let steps: Vec<usize> = list(folder.path())?.into_iter().map(|(step, _)| step).collect();
        assert_eq!(steps, [100, 3000]);
        assert!(list(&folder.path().join("missing"))?.is_empty());
        assert!(Contents::read(&path(folder.path(), 100)).is_err());
        Ok(())
    }
}
