//! The key that decides whether work must be repeated: stage name and version, every setting that influences the
//! output, and the BLAKE3 hash of every input. Paths, times and the number of workers are not part of it. `HashCache`
//! stores content hashes by size and modification time, so that a repeated check does not read the files.

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

/// Key of one unit at one stage, as separate parts, so that a difference can be named.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fingerprint {
    pub stage: String,
    pub version: u32,
    pub settings: serde_json::Value,
    /// Input role to BLAKE3 of the content, in hex.
    pub inputs: BTreeMap<String, String>,
}

impl Fingerprint {
    /// Computes the current fingerprint of `unit` at `stage`.
    pub fn now(stage: &dyn Stage, unit: &Unit, hashes: &HashCache) -> Result<Self> {
        let mut inputs = BTreeMap::new();
        for input in stage.inputs(unit)? {
            let hash = hashes.hash(&input.path).with_context(|| format!("cannot hash the {}", input.role))?;
            inputs.insert(input.role, hash);
        }
        Ok(Self { stage: stage.name().to_owned(), version: stage.version(), settings: stage.settings(unit), inputs })
    }

    /// Replaces a former stage name by the current one, both as the stage and as the name of its settings section.
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

/// BLAKE3 hashes of files, cached between runs by path, size and modification time.
pub struct HashCache {
    file: PathBuf,
    known: Mutex<BTreeMap<String, KnownHash>>,
    saved: Mutex<Instant>,
}

/// Content of a file or folder: its BLAKE3 in hex, with the size in bytes and the modification time by which it is
/// recognised without being read.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KnownHash {
    pub bytes: u64,
    changed_ns: u64,
    hash: String,
}

impl HashCache {
    /// Loads the cache from `file`; a missing or damaged file gives an empty cache.
    pub fn open(file: &Path) -> Self {
        Self { file: file.to_owned(), known: Mutex::new(read_known(file)), saved: Mutex::new(Instant::now()) }
    }

    /// Returns the BLAKE3 of the content of `path` in hex; folders are hashed as in [`hash_file`].
    pub fn hash(&self, path: &Path) -> Result<String> {
        Ok(self.content(path)?.hash)
    }

    /// Returns size and hash of the content of `path`, which is read only if it is not cached.
    pub fn content(&self, path: &Path) -> Result<KnownHash> {
        let (bytes, changed_ns) = size_and_change(path)?;
        let read = || Ok(KnownHash { bytes, changed_ns, hash: hash_file(path)? });
        // Paths that are not UTF-8 are not cached: two of them may have the same text.
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

    /// Returns whether `path` still has this content. Equal size and modification time, or a different size, decide
    /// without reading; otherwise the content is hashed.
    pub fn is_unchanged(&self, path: &Path, content: &KnownHash) -> Result<bool> {
        let (bytes, changed_ns) = size_and_change(path)?;
        let is_same_size = bytes == content.bytes;
        Ok(is_same_size && (changed_ns == content.changed_ns || self.hash(path)? == content.hash))
    }

    /// Writes the cache for the next run, merged with entries that other programs have saved in the meantime.
    pub fn save(&self) -> Result<()> {
        let mut merged = read_known(&self.file);
        merged.extend(self.known().clone());
        workdir::write_file(&self.file, &serde_json::to_vec(&merged)?)
    }

    /// Saves at most once a minute, so that a long run that is killed does not lose its hashes.
    pub fn save_periodically(&self) {
        let Ok(mut saved) = self.saved.try_lock() else { return };
        if saved.elapsed().as_secs() >= 60 {
            *saved = Instant::now();
            // Hashes that cannot be saved are computed again by the next run.
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

/// Returns the size in bytes and the modification time in ns. For a folder: the sum of the sizes, and a digest of the
/// names and modification times of its files.
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

/// Lists the files of a folder, sorted; subfolders are skipped.
fn files_in(folder: &Path) -> Result<Vec<PathBuf>> {
    let listed = fs::read_dir(folder).with_context(|| format!("cannot list {}", folder.display()))?;
    let mut files: Vec<PathBuf> = listed.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect();
    files.retain(|path| path.is_file());
    files.sort();
    Ok(files)
}

/// BLAKE3 of a file's content in hex, read in chunks; for a folder, the hash of its file names and file hashes.
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
