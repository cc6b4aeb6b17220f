//! Layout of a study folder: participants can reach the files below `public/` only.

use anyhow::{Context, Result};
use orator_base::stage::workdir;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

pub fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_slice(&bytes)
        .with_context(|| format!("{} is damaged: expected the file as written by `orator study build`", path.display()))
}

/// Writes a JSON file of a study atomically.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    let mut json = serde_json::to_vec_pretty(value)?;
    json.push(b'\n');
    workdir::write_file(path, &json)
}

#[derive(Clone, Debug)]
pub struct StudyFolder(PathBuf);

impl StudyFolder {
    pub fn new(dir: impl Into<PathBuf>) -> Self {
        Self(dir.into())
    }

    pub fn dir(&self) -> &Path {
        &self.0
    }

    /// Resolved study file: every default is written out.
    pub fn study_file(&self) -> PathBuf {
        self.0.join("study.toml")
    }

    /// Trials of each session, [`super::plan::StudyPlan`].
    pub fn plan(&self) -> PathBuf {
        self.0.join("plan.json")
    }

    /// Content of each film, [`super::plan::StudyKey`].
    pub fn key(&self) -> PathBuf {
        self.0.join("key.json")
    }

    /// Hypotheses, exclusion rules and analysis, fixed before the first participant.
    pub fn preregistration(&self) -> PathBuf {
        self.0.join("preregistration.json")
    }

    /// BLAKE3 hash of each file above and of each film, and one over all.
    pub fn seal(&self) -> PathBuf {
        self.0.join("seal.json")
    }

    /// The only folder that participants can reach.
    pub fn public(&self) -> PathBuf {
        self.0.join("public")
    }

    /// Path of the film with this opaque name of 16 hexadecimal digits.
    pub fn film(&self, film: &str) -> PathBuf {
        self.public().join("films").join(format!("{film}.mp4"))
    }

    /// SQLite database of the responses; written by `serve`, not sealed.
    pub fn responses(&self) -> PathBuf {
        self.0.join("responses.sqlite")
    }

    /// Key that signs participants' tokens, and the operator's token. Written by `serve`, readable by its owner only.
    pub fn secret(&self) -> PathBuf {
        self.0.join("secret.json")
    }
}
