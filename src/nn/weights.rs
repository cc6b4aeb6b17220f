//! Weights and metadata of networks: the contents of the files defined in `orator_formats::checkpoint`.

use anyhow::ensure;
use candle_core::safetensors::Load;
use candle_core::{DType, Device, Tensor};
use orator_base::stage::workdir;
use orator_formats::checkpoint;
use safetensors::Dtype;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// Contents of a weight file: named tensors, and metadata as JSON.
pub struct Contents {
    pub facts: Value,
    pub tensors: BTreeMap<String, Tensor>,
}

impl Contents {
    /// Returns the tensors whose names start with `prefix`, without the prefix.
    pub fn part(&self, prefix: &str) -> BTreeMap<String, Tensor> {
        let strip = |(name, tensor): (&String, &Tensor)| Some((name.strip_prefix(prefix)?.to_owned(), tensor.clone()));
        self.tensors.iter().filter_map(strip).collect()
    }

    /// Checks that the file may contain a network of at least `min_numbers` weights, before memory is allocated for it.
    pub fn expect_numbers(&self, min_numbers: usize) -> anyhow::Result<()> {
        let n_numbers: usize = self.tensors.values().map(Tensor::elem_count).sum();
        ensure!(min_numbers <= n_numbers, "the file has {n_numbers} weights, but its network at least {min_numbers}");
        Ok(())
    }

    /// Adds tensors, with `prefix` prepended to their names.
    pub fn add(&mut self, prefix: &str, tensors: BTreeMap<String, Tensor>) {
        self.tensors.extend(tensors.into_iter().map(|(name, tensor)| (format!("{prefix}{name}"), tensor)));
    }

    pub fn to_bytes(&self) -> anyhow::Result<Vec<u8>> {
        let tensors = self.tensors.iter().map(|(name, tensor)| (name.clone(), tensor));
        checkpoint::to_bytes(&self.facts, tensors)
    }

    /// Parses the output of [`Contents::to_bytes`], or published weights, whose matrices may be of half precision.
    pub fn from_bytes(bytes: &[u8]) -> anyhow::Result<Self> {
        Self::parse(bytes, &[Dtype::F32, Dtype::F16])
    }

    fn parse(bytes: &[u8], dtypes: &[Dtype]) -> anyhow::Result<Self> {
        let facts = checkpoint::facts_of(bytes)?;
        let file = safetensors::SafeTensors::deserialize(bytes)?;
        let load = |(name, view): (String, safetensors::tensor::TensorView)| {
            let (dtype, expected) = (view.dtype(), dtypes[0]);
            ensure!(dtypes.contains(&dtype), "tensor {name} has type {dtype:?}, expected {expected:?}");
            let tensor = view.load(&Device::Cpu)?;
            ensure!(
                is_finite(&tensor)?,
                "tensor {name} has a value that is not finite: the file is damaged, or the training diverged"
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

    /// Reads a checkpoint, whose tensors must all be F32.
    ///
    /// # Errors
    /// The file cannot be read, is malformed, or has a tensor of another type or a non-finite value; the file is named.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        checkpoint::read_with(path, |bytes| Self::parse(bytes, &[Dtype::F32]))
    }
}

fn is_finite(tensor: &Tensor) -> anyhow::Result<bool> {
    let numbers = tensor.flatten_all()?.to_dtype(DType::F32)?.to_vec1::<f32>()?;
    Ok(numbers.iter().all(|number| number.is_finite()))
}
