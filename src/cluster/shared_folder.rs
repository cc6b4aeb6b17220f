//! What workers on many machines ask of the folder that they share: to create a file once, to read, list and replace.
//! Nothing else is needed, and no lock, so that NFS with its caches will do.

use anyhow::{Context, Result};
use orator_base::stage::workdir;
use rustix::io::Errno;
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

/// A folder of small files that several machines see. Names have `/` between folders.
pub trait SharedFolder {
    /// Makes the file with these bytes; `false`: there is one of that name. Of several that try, one succeeds. The bytes must
    /// be no one else's.
    fn create(&self, name: &str, bytes: &[u8]) -> Result<bool>;
    /// The bytes of a file, maybe not the newest; `None`: not there, or not seen yet. What has the name and is no file that can
    /// be read (a folder, a pipe, a link to nothing) is read as empty.
    fn read(&self, name: &str) -> Result<Option<Vec<u8>>>;
    /// Names of the files of a folder, maybe without the newest; `/` follows the name of what is no file.
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
        match workdir::read_file(&path) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if is_gone(&error) && !path.is_symlink() => Ok(None),
            Err(error) if is_gone(&error) || is_no_file(&error) => Ok(Some(Vec::new())),
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
        let name = |entry: fs::DirEntry| {
            let name = entry.file_name().into_string().ok().filter(|name| !name.starts_with('.'))?;
            let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
            Some(if is_file { name } else { name + "/" })
        };
        Ok(entries.filter_map(|entry| name(entry.ok()?)).collect())
    }

    fn replace(&self, name: &str, bytes: &[u8]) -> Result<()> {
        workdir::write_file(&self.0.join(name), bytes)
    }
}

/// The file is not there, or was removed on another machine while this one had it open.
fn is_gone(error: &std::io::Error) -> bool {
    error.kind() == ErrorKind::NotFound || error.kind() == ErrorKind::StaleNetworkFileHandle
}

/// The name is that of a folder, a pipe, a socket, a circle of links, or of a file that may not be read.
fn is_no_file(error: &std::io::Error) -> bool {
    let is_other = |errno: Errno| error.raw_os_error() == Some(errno.raw_os_error());
    let kinds = [ErrorKind::IsADirectory, ErrorKind::InvalidInput, ErrorKind::PermissionDenied];
    kinds.contains(&error.kind()) || is_other(Errno::NXIO) || is_other(Errno::LOOP)
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

    #[test]
    fn what_is_no_file_holds_its_name_and_keeps_nobody_waiting() {
        let dir = tempfile::tempdir().unwrap();
        let folder = DiskFolder(dir.path().to_owned());
        let at = |name: &str| dir.path().join("a").join(name);
        fs::create_dir_all(at("folder")).unwrap();
        std::os::unix::fs::symlink("nowhere", at("link")).unwrap();
        std::os::unix::fs::symlink("circle", at("circle")).unwrap();
        assert!(std::process::Command::new("mkfifo").arg(at("pipe")).status().unwrap().success());
        for name in ["a/folder", "a/link", "a/circle", "a/pipe"] {
            assert!(!folder.create(name, b"mine").unwrap(), "{name}");
            assert_eq!(folder.read(name).unwrap().as_deref(), Some(&b""[..]), "{name}");
        }
        let mut names = folder.list("a").unwrap();
        names.sort();
        assert_eq!(names, ["circle/", "folder/", "link/", "pipe/"]);
    }
}
