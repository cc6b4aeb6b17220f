//! Locks between programs. `lock` uses a file inside a folder that stays; a `FolderLock` protects a folder that is
//! replaced or removed as a whole, so its file lies beside the folder and is deleted with the last lock. No call waits
//! for a lock: the error names the programs that hold it. The system releases a lock when its process ends.

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

/// Error: another program is working in the folder.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{} is in use by {by}; wait for it to end", folder.display())]
pub struct BusyFolder {
    pub folder: PathBuf,
    /// The programs that hold the lock: what they do, and their process ids.
    pub by: String,
}

/// A lock on a folder, `exclusive` or `shared`, until this is dropped.
#[derive(Debug)]
pub struct FolderLock {
    /// Locked file; `None`: its folder is not writable, so that no program can replace the locked folder.
    file: Option<File>,
    /// Path of the lock file, if it is deleted with the lock.
    path: Option<PathBuf>,
}

static PROGRAM: OnceLock<String> = OnceLock::new();

/// Sets the description of this program that others report when they find its locks; only the first call counts.
pub fn announce(program: String) {
    PROGRAM.get_or_init(|| program);
}

/// Locks `folder`, created if missing, for writing by this program only.
///
/// # Errors
/// `BusyFolder`; the folder is not writable.
pub fn lock(folder: &Path) -> Result<FolderLock> {
    let path = folder.join(".lock");
    fs::create_dir_all(folder).with_context(|| format!("cannot write to {}", folder.display()))?;
    let file = take(folder, &path, true)?.with_context(|| format!("cannot write to {}", folder.display()))?;
    Ok(FolderLock { file: Some(file), path: None })
}

/// Locks `folder`, created if missing, for programs that write in it and share the work; excludes `lock`.
///
/// # Errors
/// `BusyFolder`; the folder cannot be created.
pub fn lock_shared(folder: &Path) -> Result<FolderLock> {
    let path = folder.join(".lock");
    fs::create_dir_all(folder).with_context(|| format!("cannot write to {}", folder.display()))?;
    Ok(FolderLock { file: take(folder, &path, false)?, path: None })
}

impl FolderLock {
    /// Takes an exclusive lock, for replacing, changing or removing the folder.
    ///
    /// # Errors
    /// `BusyFolder`; the lock file is a link.
    pub fn exclusive(folder: &Path) -> Result<Self> {
        // Without a parent folder there is no lock; creating the folder itself then fails for the same reason.
        let _ = fs::create_dir_all(parent(folder));
        Self::beside(folder, true)
    }

    /// Takes a shared lock, for reading the folder and for writing files that are derived from it.
    ///
    /// # Errors
    /// `BusyFolder`; the lock file is a link.
    pub fn shared(folder: &Path) -> Result<Self> {
        Self::beside(folder, false)
    }

    /// Takes the lock, and restores the folder if a program was killed while replacing it.
    fn beside(folder: &Path, is_exclusive: bool) -> Result<Self> {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        // Canonical, so that all links to the folder lead to one lock file.
        let canonical = folder.canonicalize().or_else(|_| std::path::absolute(folder))?;
        let mut name = OsString::from(".");
        name.push(canonical.file_name().unwrap_or_default());
        name.push(".lock");
        let path = parent(&canonical).join(name);
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
            // The last holder deletes the file; a program that opened it meanwhile notices that and opens a new one.
            if file.unlock().is_ok() && file.try_lock().is_ok() && is_at(file, path) {
                let _ = fs::remove_file(path);
            }
        }
    }
}

/// Returns whether locks work in the existing folder `folder`: a second file handle must be rejected.
pub fn locks_work(folder: &Path) -> Result<bool> {
    let probe = folder.join(format!(".lock-probe-{}", std::process::id()));
    let tried = || -> std::io::Result<bool> {
        let (first, second) = (open(&probe)?, open(&probe)?);
        Ok(first.try_lock().is_ok() && second.try_lock().is_err())
    };
    let tried = tried().with_context(|| format!("cannot write to {}", folder.display()));
    let _ = fs::remove_file(&probe);
    tried
}

/// Locks the file at `path`, created if missing, for work in `folder`; `None`: the file cannot be created.
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
            // The file system does not support locks; `locks_work` detects that.
            Err(TryLockError::Error(error)) if error.kind() == ErrorKind::Unsupported => {}
            Err(TryLockError::Error(error)) if error.raw_os_error() == Some(Errno::NOLCK.raw_os_error()) => {}
            Err(TryLockError::Error(error)) => {
                return Err(error).with_context(|| format!("cannot lock {}", path.display()));
            }
        }
        // If the name cannot be written, only the message to other programs is less exact.
        let program = PROGRAM.get().map_or("a program that uses orator", String::as_str);
        let _ = if is_exclusive { file.set_len(0) } else { Ok(()) };
        let _ = file.write_all(format!("{} {program}\n", std::process::id()).as_bytes());
        return Ok(Some(file));
    }
}

/// Opens a lock file, created if missing: links are rejected and it is never truncated. Read-only if not writable.
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

/// Returns whether the open lock file is still the one at `path`.
fn is_at(file: &File, path: &Path) -> bool {
    let number = |meta: fs::Metadata| (meta.dev(), meta.ino());
    file.metadata().is_ok_and(|file| path.symlink_metadata().is_ok_and(|there| number(file) == number(there)))
}

/// Returns the running programs whose names are in the lock file.
fn holders(file: &File) -> String {
    let mut text = String::new();
    // An unreadable file gives no names.
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
