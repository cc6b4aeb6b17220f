//! Seal of a study: a BLAKE3 hash of each file that exists before the first participant, and a combined hash that a
//! researcher publishes in advance.

use super::folder::StudyFolder;
use anyhow::{Context, Result, bail, ensure};
use orator_base::stage::fingerprint::hash_file;
use orator_base::stage::workdir;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{fmt, fs};

const VERSION: u32 = 1;

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudySeal {
    pub version: u32,
    /// BLAKE3 of the lines `FILE HASH` of all files in the order of `files`, in hexadecimal digits.
    pub seal: String,
    /// BLAKE3 of each file in hexadecimal digits, by its path relative to the study folder.
    pub files: BTreeMap<String, String>,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SealMismatch {
    pub changed: Vec<String>,
    pub added: Vec<String>,
    pub missing: Vec<String>,
}

impl SealMismatch {
    pub fn is_empty(&self) -> bool {
        self.changed.is_empty() && self.added.is_empty() && self.missing.is_empty()
    }
}

impl fmt::Display for SealMismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kinds = [("changed", &self.changed), ("added", &self.added), ("missing", &self.missing)];
        let parts = kinds.iter().filter(|(_, files)| !files.is_empty()).map(|(kind, files)| {
            let more = if files.len() > 8 { format!(" and {} more", files.len() - 8) } else { String::new() };
            format!("{kind}: {}{more}", files[..files.len().min(8)].join(", "))
        });
        write!(f, "{}", parts.collect::<Vec<_>>().join("; "))
    }
}

impl StudySeal {
    pub fn of(folder: &StudyFolder) -> Result<Self> {
        let listed = sealed_files(folder)?;
        if let Some((name, _)) = listed.iter().find(|(_, path)| !path.is_file()) {
            bail!("{} has no {name}: rebuild the study", folder.dir().display());
        }
        let files: BTreeMap<String, String> =
            listed.iter().map(|(name, path)| Ok((name.clone(), hash_file(path)?))).collect::<Result<_>>()?;
        Ok(Self { version: VERSION, seal: combined_hash(&files), files })
    }

    /// Writes the seal atomically. Written last, so its presence marks a finished build.
    pub fn write(&self, folder: &StudyFolder) -> Result<()> {
        workdir::write_file(&folder.seal(), &serde_json::to_vec_pretty(self)?)
    }

    /// Reads the seal of a study.
    ///
    /// # Errors
    /// The seal is missing, damaged, of another version, or does not match its own combined hash.
    pub fn read(folder: &StudyFolder) -> Result<Self> {
        let path = folder.seal();
        let bytes = fs::read(&path).with_context(|| {
            format!(
                "{} is not a finished study: it has no seal; `orator study build` creates one",
                folder.dir().display()
            )
        })?;
        let path = path.display();
        let read: Self = serde_json::from_slice(&bytes)
            .with_context(|| format!("{path} is damaged: restore it, or rebuild the study in a new folder"))?;
        ensure!(
            read.version == VERSION,
            "{path} has version {}, expected {VERSION}: use the version of orator that wrote it",
            read.version
        );
        ensure!(
            read.seal == combined_hash(&read.files),
            "{path} was modified: the combined hash of its files is not {}; restore it, or rebuild the study in a new \
             folder",
            read.seal
        );
        Ok(read)
    }

    /// Reads the seal and checks every file against it.
    ///
    /// # Errors
    /// The seal cannot be read, or files were changed, added or removed; the error names them.
    pub fn verify(folder: &StudyFolder) -> Result<Self> {
        let seal = Self::read(folder)?;
        let mismatch = seal.compare(folder)?;
        ensure!(
            mismatch.is_empty(),
            "{} was modified after sealing ({mismatch}): restore these files, or rebuild the study in a new folder",
            folder.dir().display()
        );
        Ok(seal)
    }

    pub fn compare(&self, folder: &StudyFolder) -> Result<SealMismatch> {
        let mut mismatch = SealMismatch::default();
        let listed = sealed_files(folder)?;
        for (name, path) in &listed {
            match self.files.get(name) {
                _ if !path.is_file() => {}
                Some(hash) if *hash == hash_file(path)? => {}
                Some(_) => mismatch.changed.push(name.clone()),
                None => mismatch.added.push(name.clone()),
            }
        }
        let exists = |name: &String| listed.get(name).is_some_and(|path| path.is_file());
        mismatch.missing = self.files.keys().filter(|name| !exists(name)).cloned().collect();
        Ok(mismatch)
    }
}

fn combined_hash(files: &BTreeMap<String, String>) -> String {
    let lines: String = files.iter().map(|(name, hash)| format!("{name} {hash}\n")).collect();
    blake3::hash(lines.as_bytes()).to_hex().to_string()
}

/// Paths covered by a seal, by relative name: the four files of the study, whether they exist or not, and all files
/// below `public/`. Hidden files are ignored, because the server never serves them.
fn sealed_files(folder: &StudyFolder) -> Result<BTreeMap<String, PathBuf>> {
    let mut paths = vec![folder.study_file(), folder.plan(), folder.key(), folder.preregistration()];
    collect_files(&folder.public(), &mut paths)?;
    let named = paths.into_iter().map(|path| {
        let name = path.strip_prefix(folder.dir()).unwrap_or(&path).to_string_lossy().replace('\\', "/");
        (name, path)
    });
    Ok(named.collect())
}

fn collect_files(dir: &Path, paths: &mut Vec<PathBuf>) -> Result<()> {
    let unreadable = || format!("cannot list {}", dir.display());
    for entry in fs::read_dir(dir).with_context(unreadable)? {
        let entry = entry.with_context(unreadable)?;
        let kind = entry.file_type().with_context(unreadable)?;
        if entry.file_name().as_encoded_bytes().starts_with(b".") {
            continue;
        }
        if kind.is_dir() {
            collect_files(&entry.path(), paths)?;
        } else {
            let path = entry.path();
            ensure!(kind.is_file(), "{} is not a regular file: replace it with the film itself", path.display());
            paths.push(path);
        }
    }
    Ok(())
}
