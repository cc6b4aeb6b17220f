//! The record of finished work, which is written last, and the reasons why a unit is not up to date.

use super::fingerprint::{Fingerprint, hash_file};
use super::workdir;
use anyhow::Result;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

/// Finished work on a unit: its key, and every file that it wrote.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Record {
    pub fingerprint: Fingerprint,
    pub outputs: Vec<Output>,
    /// Report line of the stage, for the user.
    pub line: String,
    /// Values reported by the stage, for programs.
    pub facts: serde_json::Map<String, serde_json::Value>,
}

/// A file in a unit's folder; `file` is relative to the folder, with `/` as the separator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Output {
    pub file: String,
    pub bytes: u64,
    pub hash: String,
}

/// Last failure of a unit, stored beside the files of an earlier success.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Failure {
    pub fingerprint: Option<Fingerprint>,
    pub error: String,
}

/// Reasons why a unit must be processed.
#[derive(Clone, Debug, PartialEq)]
pub enum DirtyReason {
    NeverDone,
    Forced,
    StageChanged { was: u32, now: u32 },
    SettingChanged { key: String, was: String, now: String },
    InputChanged { role: String },
    InputAdded { role: String },
    InputRemoved { role: String },
    OutputMissing { file: String },
    OutputChanged { file: String },
    WaitsFor { stage: String },
}

impl fmt::Display for DirtyReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NeverDone => write!(f, "not run yet"),
            Self::Forced => write!(f, "forced by --force"),
            Self::StageChanged { was, now } => write!(f, "the stage changed from version {was} to {now}"),
            Self::SettingChanged { key, was, now } => write!(f, "{key} changed from {was} to {now}"),
            Self::InputChanged { role } => write!(f, "the {role} changed"),
            Self::InputAdded { role } => write!(f, "the {role} was added"),
            Self::InputRemoved { role } => write!(f, "the {role} was removed"),
            Self::OutputMissing { file } => write!(f, "output {file} is missing"),
            Self::OutputChanged { file } => write!(f, "output {file} was modified"),
            Self::WaitsFor { stage } => write!(f, "waiting for {stage}"),
        }
    }
}

/// Path of the record of the unit in `folder`: `NAME.record.json` beside it.
pub fn record_path(folder: &Path) -> PathBuf {
    beside(folder, "record.json")
}

/// Path of the failure of the unit in `folder`: `NAME.failed.json` beside it.
pub fn failure_path(folder: &Path) -> PathBuf {
    beside(folder, "failed.json")
}

fn beside(folder: &Path, suffix: &str) -> PathBuf {
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    folder.with_file_name(format!("{name}.{suffix}"))
}

impl Record {
    /// Reads the record of the unit in `folder`; `None` if there is no readable record.
    pub fn read(folder: &Path) -> Option<Self> {
        let record: Self = serde_json::from_slice(&workdir::read_file(&record_path(folder)).ok()?).ok()?;
        Some(Self { fingerprint: record.fingerprint.renamed(), ..record })
    }

    /// Removes an earlier failure and writes the record of the unit in `folder`.
    ///
    /// # Errors
    /// The disk reports an error, also when flushing. No record is then left that would contradict the failure.
    pub fn write(&self, folder: &Path) -> Result<()> {
        Failure::forget(folder)?;
        let path = record_path(folder);
        workdir::write_file(&path, &serde_json::to_vec_pretty(self)?).inspect_err(|_| drop(fs::remove_file(&path)))
    }

    /// Removes the record of the unit in `folder`, and flushes the removal to disk.
    pub fn forget(folder: &Path) -> Result<()> {
        workdir::remove_file(&record_path(folder))
    }

    /// Why the unit in `folder` is not up to date for fingerprint `now`; `None`: it is. Outputs are compared by size.
    pub fn dirty(&self, now: &Fingerprint, folder: &Path) -> Option<DirtyReason> {
        difference(&self.fingerprint, now).or_else(|| self.outputs.iter().find_map(|output| output.missing(folder)))
    }
}

impl Output {
    fn missing(&self, folder: &Path) -> Option<DirtyReason> {
        let file = self.file.clone();
        match fs::metadata(folder.join(&self.file)) {
            Err(_) => Some(DirtyReason::OutputMissing { file }),
            Ok(meta) if meta.len() != self.bytes => Some(DirtyReason::OutputChanged { file }),
            Ok(_) => None,
        }
    }

    /// Lists every file under `folder`, sorted by name, with its size and hash.
    pub fn list(folder: &Path) -> Result<Vec<Self>> {
        let mut outputs = Vec::new();
        collect(folder, "", &mut outputs)?;
        outputs.sort_by(|a, b| a.file.cmp(&b.file));
        Ok(outputs)
    }
}

fn collect(folder: &Path, prefix: &str, outputs: &mut Vec<Output>) -> Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let file = format!("{prefix}{}", path.file_name().unwrap_or_default().to_string_lossy());
        if path.is_dir() {
            collect(&path, &format!("{file}/"), outputs)?;
        } else {
            outputs.push(Output { file, bytes: fs::metadata(&path)?.len(), hash: hash_file(&path)? });
        }
    }
    Ok(())
}

impl Failure {
    /// Reads the failure of the unit in `folder`, if its last attempt failed.
    pub fn read(folder: &Path) -> Option<Self> {
        let failure: Self = serde_json::from_slice(&workdir::read_file(&failure_path(folder)).ok()?).ok()?;
        Some(Self { fingerprint: failure.fingerprint.map(Fingerprint::renamed), ..failure })
    }

    /// Removes the failure of the unit in `folder`, if there is one.
    pub fn forget(folder: &Path) -> Result<()> {
        workdir::remove_file(&failure_path(folder))
    }

    /// Writes the failure beside the existing files.
    pub fn write(&self, folder: &Path) -> Result<()> {
        workdir::write_file(&failure_path(folder), &serde_json::to_vec_pretty(self)?)
    }
}

fn difference(was: &Fingerprint, now: &Fingerprint) -> Option<DirtyReason> {
    if was.version != now.version || was.stage != now.stage {
        return Some(DirtyReason::StageChanged { was: was.version, now: now.version });
    }
    if let Some(reason) = setting_difference("", &was.settings, &now.settings) {
        return Some(reason);
    }
    for (role, hash) in &now.inputs {
        match was.inputs.get(role) {
            None => return Some(DirtyReason::InputAdded { role: role.clone() }),
            Some(old) if old != hash => return Some(DirtyReason::InputChanged { role: role.clone() }),
            Some(_) => {}
        }
    }
    let gone = was.inputs.keys().find(|role| !now.inputs.contains_key(*role));
    gone.map(|role| DirtyReason::InputRemoved { role: role.clone() })
}

/// Returns the first setting that differs, by its dotted key.
fn setting_difference(key: &str, was: &serde_json::Value, now: &serde_json::Value) -> Option<DirtyReason> {
    if let (Some(was), Some(now)) = (was.as_object(), now.as_object()) {
        let mut names: Vec<&String> = was.keys().chain(now.keys()).collect();
        names.sort();
        names.dedup();
        let null = serde_json::Value::Null;
        return names.into_iter().find_map(|name| {
            let inner = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
            setting_difference(&inner, was.get(name).unwrap_or(&null), now.get(name).unwrap_or(&null))
        });
    }
    let changed = || DirtyReason::SettingChanged { key: key.to_owned(), was: was.to_string(), now: now.to_string() };
    (was != now).then(changed)
}
