//! The key that decides whether work must be done again: stage name and version, every setting that has a say in the bytes,
//! and the BLAKE3 of every input. Paths, times and the number of workers are not in it. Contents are hashed once and
//! remembered by size and time of change (`HashCache`), so that asking again costs nothing.

use super::artifacts::StageName;
use super::{Stage, Unit, workdir};
use crate::input;
use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Instant, UNIX_EPOCH};

/// The key of one unit at one stage, in its parts so that a difference can be named.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fingerprint {
    pub stage: String,
    pub version: u32,
    pub settings: serde_json::Value,
    /// Role to BLAKE3 of the content, in hex.
    pub inputs: BTreeMap<String, String>,
}

impl Fingerprint {
    /// The fingerprint of `unit` at `stage` now. Errors when an input cannot be read.
    pub fn now(stage: &dyn Stage, unit: &Unit, hashes: &HashCache) -> Result<Self> {
        let mut inputs = BTreeMap::new();
        for input in stage.inputs(unit)? {
            let hash = hashes.hash(&input.path).with_context(|| format!("the {} of this stage", input.role))?;
            inputs.insert(input.role, hash);
        }
        Ok(Self { stage: stage.name().to_owned(), version: stage.version(), settings: stage.settings(unit), inputs })
    }

    /// A fingerprint that stands under a former name of its stage, under today's: as the stage, and as the section of the
    /// settings.
    pub fn renamed(mut self) -> Self {
        if let Some(stage) = StageName::ALL.into_iter().find(|stage| stage.former() == Some(&*self.stage)) {
            if let Some(settings) = self.settings.as_object_mut()
                && let Some(section) = settings.remove(&self.stage)
            {
                settings.insert(stage.to_string(), section);
            }
            self.stage = stage.to_string();
        }
        self
    }
}

/// BLAKE3 of files, remembered between runs by path, size and time of change.
pub struct HashCache {
    file: PathBuf,
    known: Mutex<BTreeMap<String, KnownHash>>,
    saved: Mutex<Instant>,
}

/// The content of a file or folder: its BLAKE3 in hex, with the size in bytes and the time of change by which it is known
/// again without being read.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KnownHash {
    pub bytes: u64,
    changed_ns: u64,
    hash: String,
}

impl HashCache {
    /// Reads what is known from `file`; a missing or damaged file knows nothing.
    pub fn open(file: &Path) -> Self {
        Self { file: file.to_owned(), known: Mutex::new(read_known(file)), saved: Mutex::new(Instant::now()) }
    }

    /// BLAKE3 of the content of `path`, in hex; of a folder as `hash_file` says.
    pub fn hash(&self, path: &Path) -> Result<String> {
        Ok(self.content(path)?.hash)
    }

    /// The content of `path`; it is read where it is not known. Errors: it cannot be read.
    pub fn content(&self, path: &Path) -> Result<KnownHash> {
        let (bytes, changed_ns) = size_and_change(path)?;
        let read = || Ok(KnownHash { bytes, changed_ns, hash: hash_file(path)? });
        // Two names that are no text may look alike.
        let Some(name) = path.to_str().map(str::to_owned) else { return read() };
        if let Some(known) = self.known().get(&name)
            && known.bytes == bytes
            && known.changed_ns == changed_ns
        {
            return Ok(known.clone());
        }
        let content = read()?;
        self.known().insert(name, content.clone());
        Ok(content)
    }

    /// Whether `path` still has this content. Size and time of change decide where they are equal, and a different size does;
    /// else the content is hashed. Errors: it cannot be read.
    pub fn is_unchanged(&self, path: &Path, content: &KnownHash) -> Result<bool> {
        let (bytes, changed_ns) = size_and_change(path)?;
        let is_same_size = bytes == content.bytes;
        Ok(is_same_size && (changed_ns == content.changed_ns || self.hash(path)? == content.hash))
    }

    /// Keeps what is known for the next run, beside what other programs have kept meanwhile.
    pub fn save(&self) -> Result<()> {
        let mut kept = read_known(&self.file);
        kept.extend(self.known().clone());
        workdir::write_file(&self.file, &serde_json::to_vec(&kept)?)
    }

    /// Saves once a minute at most, so that a long run that is killed has not hashed for nothing.
    pub fn save_now_and_then(&self) {
        let Ok(mut saved) = self.saved.try_lock() else { return };
        if saved.elapsed().as_secs() >= 60 {
            *saved = Instant::now();
            // What cannot be kept is hashed again.
            let _ = self.save();
        }
    }

    fn known(&self) -> std::sync::MutexGuard<'_, BTreeMap<String, KnownHash>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn read_known(file: &Path) -> BTreeMap<String, KnownHash> {
    workdir::read_file(file).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok()).unwrap_or_default()
}

/// Bytes of a file, and its time of change in ns; of a folder the sum over its files, and a digest of their names and
/// times.
fn size_and_change(path: &Path) -> Result<(u64, u64)> {
    let meta = fs::metadata(path).with_context(|| format!("cannot read {}", path.display()))?;
    if !meta.is_dir() {
        anyhow::ensure!(meta.is_file(), "{} is not a file", path.display());
        let changed = meta.modified().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        return Ok((meta.len(), changed.map_or(0, |age| age.as_nanos() as u64)));
    }
    let (mut bytes, mut digest) = (0, blake3::Hasher::new());
    for file in files_in(path)? {
        let (file_bytes, changed_ns) = size_and_change(&file)?;
        bytes += file_bytes;
        digest.update(file.as_os_str().as_encoded_bytes()).update(&changed_ns.to_le_bytes());
    }
    let digest = *digest.finalize().as_bytes();
    Ok((bytes, digest.iter().take(8).fold(0, |number, byte| number << 8 | u64::from(*byte))))
}

/// The files of a folder, sorted; folders in it are passed over.
fn files_in(folder: &Path) -> Result<Vec<PathBuf>> {
    let listed = fs::read_dir(folder).with_context(|| format!("cannot list {}", folder.display()))?;
    let mut files: Vec<PathBuf> = listed.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect();
    files.retain(|path| path.is_file());
    files.sort();
    Ok(files)
}

/// BLAKE3 of a file's content, in hex, read in pieces; of a folder that of the names and hashes of its files.
pub fn hash_file(path: &Path) -> Result<String> {
    if path.is_dir() {
        let mut hasher = blake3::Hasher::new();
        for file in files_in(path)? {
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            hasher.update(format!("{name} {}\n", hash_file(&file)?).as_bytes());
        }
        return Ok(hasher.finalize().to_hex().to_string());
    }
    let read = || -> std::io::Result<String> {
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(input::open(path)?)?;
        Ok(hasher.finalize().to_hex().to_string())
    };
    read().with_context(|| format!("cannot read {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_under_a_former_name_counts_under_todays() {
        let of = |name: &str| Fingerprint {
            stage: name.to_owned(),
            version: 2,
            settings: serde_json::json!({ name: { "max_mb": 256 }, "tool": "1" }),
            inputs: BTreeMap::new(),
        };
        assert_eq!(of("shard").renamed(), of("dataset"));
        assert_eq!(of("lift").renamed(), of("lift"));
    }
}
