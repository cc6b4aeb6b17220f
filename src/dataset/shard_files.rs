//! The shards of a dataset, open while they are used: a dataset may have more of them than a program may have open files.

use anyhow::{Context, Result};
use orator_base::types::file_name::FileName;
use std::collections::{BTreeSet, VecDeque};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Files held open at a time; programs may have 1,024 by default.
const MOST_OPEN: usize = 256;

/// Shards of a folder; threads share it.
pub struct ShardFiles {
    dir: PathBuf,
    names: BTreeSet<FileName>,
    /// Those open, the one used last in front.
    open: Mutex<VecDeque<(FileName, Arc<File>)>>,
}

impl ShardFiles {
    /// Shards of those names in `dir`.
    pub fn new(dir: &Path, names: BTreeSet<FileName>) -> Self {
        Self { dir: dir.to_owned(), names, open: Mutex::default() }
    }

    /// The file of a shard.
    ///
    /// # Errors
    /// A name that is none of its shards'; a file that cannot be opened.
    pub fn get(&self, name: &FileName) -> Result<Arc<File>> {
        self.names.get(name).context("no such shard")?;
        let mut open = self.open.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let used = match open.iter().position(|(known, _)| known == name) {
            Some(at) => open.remove(at),
            None => None,
        };
        let used = match used {
            Some(used) => used,
            None => {
                let path = self.dir.join(name);
                let file = File::open(&path).with_context(|| format!("opening the shard {}", path.display()))?;
                (name.clone(), Arc::new(file))
            }
        };
        let file = used.1.clone();
        open.push_front(used);
        open.truncate(MOST_OPEN);
        Ok(file)
    }
}
