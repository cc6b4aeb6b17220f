//! Locks that keep programs apart. `lock` is inside a folder that stays; a `FolderLock` is for a folder that is replaced
//! or removed as a whole, so that its file lies beside it and goes with the last that holds it. No lock is waited for:
//! who comes second is told who is at work. A lock goes with its process, however that ends.

use super::file::parent;
use super::folder::{recover_folder, restore_folder};
use super::process::is_alive;
use anyhow::{Context, Result};
use rustix::fs::OFlags;
use rustix::io::Errno;
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Another program works in the folder.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{by} is at work in {}; wait for it to end", folder.display())]
pub struct BusyFolder {
    /// The folder with the lock.
    pub folder: PathBuf,
    /// Who has it: what the programs do, and their processes.
    pub by: String,
}

/// A folder that others leave alone (`exclusive`), or only read (`shared`), until this is dropped.
#[derive(Debug)]
pub struct FolderLock {
    /// `None`: nothing can be written there, so that nobody replaces the folder either.
    file: Option<File>,
    /// The lock file, where it goes with the lock.
    path: Option<PathBuf>,
}

static PROGRAM: OnceLock<String> = OnceLock::new();

/// Says what this program does, for others that find its locks; once.
pub fn announce(program: String) {
    PROGRAM.get_or_init(|| program);
}

/// One program at a time writes in `folder`, made if missing. Errors when another has it, or the folder cannot be
/// written in.
pub fn lock(folder: &Path) -> Result<FolderLock> {
    let path = folder.join(".lock");
    fs::create_dir_all(folder).with_context(|| format!("cannot write in {}", folder.display()))?;
    let file = take(folder, &path, true)?.with_context(|| format!("cannot write in {}", folder.display()))?;
    Ok(FolderLock { file: Some(file), path: None })
}

/// Several programs write in `folder`, made if missing, who share the work among themselves; none has it alone. Errors as
/// those of `lock`.
pub fn lock_with_others(folder: &Path) -> Result<FolderLock> {
    let path = folder.join(".lock");
    fs::create_dir_all(folder).with_context(|| format!("cannot write in {}", folder.display()))?;
    Ok(FolderLock { file: take(folder, &path, false)?, path: None })
}

impl FolderLock {
    /// Exclusive lock, for replacing, changing or removing the folder. Errors: `BusyFolder`; the lock file is a link.
    pub fn exclusive(folder: &Path) -> Result<Self> {
        // Without a folder to lie in, there is no lock; making the folder itself fails for the same reason.
        let _ = fs::create_dir_all(parent(folder));
        Self::beside(folder, true)
    }

    /// Shared lock, for reading the folder and for writing files that are derived from it. Errors: `BusyFolder`; the
    /// lock file is a link.
    pub fn shared(folder: &Path) -> Result<Self> {
        Self::beside(folder, false)
    }

    /// Takes the lock, and puts the folder back where a killed program was replacing it.
    fn beside(folder: &Path, is_exclusive: bool) -> Result<Self> {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        // One lock file, whichever links lead to the folder.
        let place = folder.canonicalize().or_else(|_| std::path::absolute(folder))?;
        let mut name = OsString::from(".");
        name.push(place.file_name().unwrap_or_default());
        name.push(".lock");
        let path = parent(&place).join(name);
        let lock = Self { file: take(folder, &path, is_exclusive)?, path: Some(path) };
        if is_exclusive {
            recover_folder(folder)?;
        } else {
            restore_folder(folder)?;
        }
        Ok(lock)
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        if let (Some(file), Some(path)) = (&self.file, &self.path) {
            // The last one takes the file away; whoever opened it meanwhile sees that and opens another.
            if file.unlock().is_ok() && file.try_lock().is_ok() && is_at(file, path) {
                let _ = fs::remove_file(path);
            }
        }
    }
}

/// Whether locks keep programs apart in `folder`, which is there: a second handle is refused.
pub fn are_kept_apart(folder: &Path) -> Result<bool> {
    let probe = folder.join(format!(".lock-probe-{}", std::process::id()));
    let tried = || -> std::io::Result<bool> {
        let (first, second) = (open(&probe)?, open(&probe)?);
        Ok(first.try_lock().is_ok() && second.try_lock().is_err())
    };
    let tried = tried().with_context(|| format!("cannot write in {}", folder.display()));
    let _ = fs::remove_file(&probe);
    tried
}

/// Locks the file at `path`, made if missing, for work in `folder`; `None`: no file can be made there.
fn take(folder: &Path, path: &Path, is_exclusive: bool) -> Result<Option<File>> {
    loop {
        let mut file = match open(path) {
            Ok(file) => file,
            Err(error) if error.raw_os_error() == Some(Errno::LOOP.raw_os_error()) => {
                anyhow::bail!("{} is a link, expected a lock file; remove it", path.display())
            }
            Err(error) => match error.kind() {
                ErrorKind::IsADirectory | ErrorKind::InvalidInput => {
                    anyhow::bail!("{} is a folder or a pipe, expected a lock file; remove it", path.display())
                }
                ErrorKind::NotFound | ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => return Ok(None),
                _ => return Err(error).with_context(|| format!("cannot open the lock file {}", path.display())),
            },
        };
        match if is_exclusive { file.try_lock() } else { file.try_lock_shared() } {
            Ok(()) if !is_at(&file, path) => continue,
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(BusyFolder { folder: folder.to_owned(), by: holders(&file) }.into());
            }
            // A file system without locks, as `are_kept_apart` says.
            Err(TryLockError::Error(error)) if error.kind() == ErrorKind::Unsupported => {}
            Err(TryLockError::Error(error)) if error.raw_os_error() == Some(Errno::NOLCK.raw_os_error()) => {}
            Err(TryLockError::Error(error)) => {
                return Err(error).with_context(|| format!("cannot lock {}", path.display()));
            }
        }
        // A name that cannot be left only makes the message to others poorer.
        let program = PROGRAM.get().map_or("a program that uses orator", String::as_str);
        let _ = if is_exclusive { file.set_len(0) } else { Ok(()) };
        let _ = file.write_all(format!("{} {program}\n", std::process::id()).as_bytes());
        return Ok(Some(file));
    }
}

/// Opens a lock file, made if missing: never a link, never cut off. Only to be read, where it may not be written. Errors:
/// `ErrorKind::InvalidInput` of a named pipe.
fn open(path: &Path) -> std::io::Result<File> {
    let flags = (OFlags::NOFOLLOW | OFlags::NONBLOCK).bits() as i32;
    let mut options = OpenOptions::new();
    let opened = match options.read(true).append(true).create(true).custom_flags(flags).open(path) {
        Err(error) if matches!(error.kind(), ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem) => {
            OpenOptions::new().read(true).custom_flags(flags).open(path)
        }
        opened => opened,
    };
    let file = opened?;
    if file.metadata()?.is_file() { Ok(file) } else { Err(ErrorKind::InvalidInput.into()) }
}

/// Whether the open lock file is still the one at `path`.
fn is_at(file: &File, path: &Path) -> bool {
    let number = |meta: fs::Metadata| (meta.dev(), meta.ino());
    file.metadata().is_ok_and(|file| path.symlink_metadata().is_ok_and(|there| number(file) == number(there)))
}

/// Those that wrote their names into the lock file and are at work.
fn holders(file: &File) -> String {
    let mut text = String::new();
    // What cannot be read names nobody.
    let _ = file.take(1 << 16).read_to_string(&mut text);
    let line = |line: &str| {
        let (process, program) = line.split_once(' ')?;
        let process = process.parse().ok().filter(|process| is_alive(*process))?;
        Some(format!("`{program}` (process {process})"))
    };
    let mut names: Vec<String> = text.lines().filter_map(line).collect();
    names.sort();
    names.dedup();
    if names.is_empty() { "another program".to_owned() } else { names.join(" and ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readers_share_and_a_writer_is_told_who_they_are() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("host");
        let (first, second) = (FolderLock::shared(&folder).unwrap(), FolderLock::shared(&folder).unwrap());
        let error = FolderLock::exclusive(&folder).unwrap_err();
        let said = format!("(process {}) is at work in {}", std::process::id(), folder.display());
        assert!(error.is::<BusyFolder>() && error.to_string().contains(&said), "{error}");
        drop(first);
        assert!(FolderLock::exclusive(&folder).is_err());
        drop(second);
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0, "the file goes with the last");
        let writer = FolderLock::exclusive(&folder).unwrap();
        assert!(FolderLock::shared(&folder).is_err());
        drop(writer);
        assert!(are_kept_apart(dir.path()).unwrap());
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_lock_file_is_never_a_link_and_never_cut_off() {
        let dir = tempfile::tempdir().unwrap();
        let (work, victim) = (dir.path().join("work"), dir.path().join("victim"));
        fs::write(&victim, "precious").unwrap();
        fs::create_dir(&work).unwrap();
        for path in [work.join(".lock"), dir.path().join(".work.lock")] {
            std::os::unix::fs::symlink(&victim, &path).unwrap();
        }
        for error in [lock(&work).unwrap_err(), FolderLock::shared(&work).unwrap_err()] {
            assert!(error.to_string().contains("is a link"), "{error:#}");
        }
        assert_eq!(fs::read_to_string(&victim).unwrap(), "precious");
        for is_folder in [true, false] {
            super::super::remove(&work.join(".lock")).unwrap();
            if is_folder {
                fs::create_dir(work.join(".lock")).unwrap();
            } else {
                assert!(std::process::Command::new("mkfifo").arg(work.join(".lock")).status().unwrap().success());
            }
            let error = lock(&work).unwrap_err().to_string();
            assert!(error.contains("is a folder or a pipe") && error.contains("remove it"), "{error}");
        }
        fs::remove_file(work.join(".lock")).unwrap();
        let first = lock(&work).unwrap();
        let text = fs::read_to_string(work.join(".lock")).unwrap();
        assert!(lock(&work).is_err());
        assert_eq!(fs::read_to_string(work.join(".lock")).unwrap(), text, "who is refused changes nothing");
        drop(first);
        assert!(lock(&work).is_ok());
    }

    #[test]
    fn who_reads_a_folder_that_was_being_replaced_finds_it() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("host");
        fs::create_dir(dir.path().join(".host.old")).unwrap();
        let _lock = FolderLock::shared(&folder).unwrap();
        assert!(folder.is_dir());
    }
}
