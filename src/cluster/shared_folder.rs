//! What workers on many machines ask of the folder that they share: to create a file once, to read, list and replace.
//! Nothing else is needed, and no lock, so that NFS with its caches will do.

use anyhow::{Context, Result};
use orator_base::stage::workdir;
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

/// A folder of small files that several machines see. Names have `/` between folders.
pub trait SharedFolder {
    /// Makes the file with these bytes; `false`: there is one of that name. Of several that try, one succeeds. The bytes must
    /// be no one else's.
    fn create(&self, name: &str, bytes: &[u8]) -> Result<bool>;
    /// The bytes of a file, maybe not the newest; `None`: not there, or not seen yet.
    fn read(&self, name: &str) -> Result<Option<Vec<u8>>>;
    /// Names of the files of a folder, maybe without the newest.
    fn list(&self, folder: &str) -> Result<Vec<String>>;
    /// Puts the bytes in the place of a file that this worker alone writes.
    fn replace(&self, name: &str, bytes: &[u8]) -> Result<()>;
}

/// A folder of a file system.
#[derive(Clone, Debug)]
pub struct DiskFolder(pub PathBuf);

impl SharedFolder for DiskFolder {
    /// By a hard link to a file that is whole, which every network file system does at once or not at all.
    fn create(&self, name: &str, bytes: &[u8]) -> Result<bool> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let path = self.0.join(name);
        let folder = path.parent().context("a file without a folder")?;
        fs::create_dir_all(folder).with_context(|| format!("cannot write in {}", folder.display()))?;
        let token = blake3::hash(bytes).to_hex();
        let draft =
            folder.join(format!(".{}-{}-{}", &token[..16], std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed)));
        let written = fs::File::create_new(&draft).and_then(|mut file| {
            file.write_all(bytes)?;
            file.sync_all()
        });
        let linked = written.and_then(|()| fs::hard_link(&draft, &path));
        let removed = fs::remove_file(&draft);
        match linked {
            Ok(()) => {
                removed.with_context(|| format!("cannot remove {}", draft.display()))?;
                Ok(true)
            }
            // A link whose answer was lost is asked for again by the system, and then there already.
            Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(self.read(name)?.as_deref() == Some(bytes)),
            Err(error) => Err(workdir::full_disk(error.into()))
                .with_context(|| format!("cannot link {}: workers need a file system with hard links", path.display())),
        }
    }

    fn read(&self, name: &str) -> Result<Option<Vec<u8>>> {
        let path = self.0.join(name);
        match fs::read(&path) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if is_gone(&error) => Ok(None),
            Err(error) => Err(error).with_context(|| format!("cannot read {}", path.display())),
        }
    }

    fn list(&self, folder: &str) -> Result<Vec<String>> {
        let path = self.0.join(folder);
        let entries = match fs::read_dir(&path) {
            Ok(entries) => entries,
            Err(error) if is_gone(&error) => return Ok(Vec::new()),
            Err(error) => return Err(error).with_context(|| format!("cannot list {}", path.display())),
        };
        let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        Ok(names.filter(|name| !name.starts_with('.')).collect())
    }

    fn replace(&self, name: &str, bytes: &[u8]) -> Result<()> {
        workdir::write_file(&self.0.join(name), bytes)
    }
}

/// The file is not there, or was removed on another machine while this one had it open.
fn is_gone(error: &std::io::Error) -> bool {
    error.kind() == ErrorKind::NotFound || error.kind() == ErrorKind::StaleNetworkFileHandle
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_that_create_a_file_one_succeeds() {
        let dir = tempfile::tempdir().unwrap();
        let folder = DiskFolder(dir.path().to_owned());
        let created: usize = std::thread::scope(|scope| {
            let tries: Vec<_> = (0..8)
                .map(|worker| {
                    let folder = &folder;
                    scope.spawn(move || {
                        let made =
                            |unit: i32| folder.create(&format!("a/{unit}"), format!("worker {worker}").as_bytes());
                        (0..50).filter(|unit| made(*unit).unwrap()).count()
                    })
                })
                .collect();
            tries.into_iter().map(|one| one.join().unwrap()).sum()
        });
        assert_eq!(created, 50);
        assert_eq!(folder.list("a").unwrap().len(), 50);
        assert_eq!(fs::read_dir(dir.path().join("a")).unwrap().count(), 50, "no draft is left");
        assert_eq!(folder.list("b").unwrap(), Vec::<String>::new());
        assert_eq!(folder.read("b/c").unwrap(), None);
    }
}
