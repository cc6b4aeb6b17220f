//! Writing one file, or several into an existing folder; flushing to disk, and the error of a full one.

use super::attempt;
use anyhow::{Context, Result};
use rustix::fs::OFlags;
use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

/// Error: the disk is full, or a quota is exhausted.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct NoSpace(anyhow::Error);

impl NoSpace {
    /// Wraps the error of the failed write.
    pub fn new(error: anyhow::Error) -> Self {
        Self(error)
    }
}

/// Converts an error caused by a full disk into `NoSpace` with the same text; returns any other error unchanged.
pub fn full_disk(error: anyhow::Error) -> anyhow::Error {
    let is_full = |error: &std::io::Error| matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded);
    let full = error.chain().filter_map(|cause| cause.downcast_ref()).any(is_full);
    if full { NoSpace(error).into() } else { error }
}

/// Returns the folder that contains `path`.
pub(crate) fn parent(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// Returns the total size in bytes of the files in a folder and its subfolders; unreadable entries count as 0.
pub fn bytes_under(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let bytes = |entry: fs::DirEntry| match entry.metadata() {
        Ok(meta) if meta.is_dir() => bytes_under(&entry.path()),
        Ok(meta) => meta.len(),
        Err(_) => 0,
    };
    entries.map(bytes).sum()
}

/// Flushes a file, or the entries of a folder, to disk.
pub(crate) fn flush(path: &Path) -> Result<()> {
    Ok(File::open(path)?.sync_all()?)
}

/// Flushes a folder with all its contents to disk.
pub(crate) fn flush_tree(folder: &Path) -> Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() { flush_tree(&path)? } else { flush(&path)? }
    }
    flush(folder)
}

/// Reads a file completely. It never waits for a writer.
///
/// # Errors
/// Those of `fs::read`; `path` is a folder (`ErrorKind::IsADirectory`) or another non-regular file, such as a named
/// pipe (`ErrorKind::InvalidInput`).
pub fn read_file(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut file = OpenOptions::new().read(true).custom_flags(OFlags::NONBLOCK.bits() as i32).open(path)?;
    if !file.metadata()?.is_file() {
        let kind = if path.is_dir() { ErrorKind::IsADirectory } else { ErrorKind::InvalidInput };
        return Err(kind.into());
    }
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Writes `bytes` to `path` atomically and creates its folder if missing.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    replace(path, |attempt| Ok(File::create(attempt)?.write_all(bytes)?))
}

/// Calls `write` with the path of a new empty file beside `path`, with the same extension, and then renames it to
/// `path`. Creates the folder of `path` if missing.
///
/// # Errors
/// Those of `write`; a file operation fails (`NoSpace` if the disk is full). The file at `path` is then unchanged.
pub fn replace(path: &Path, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let folder = parent(path);
    fs::create_dir_all(&folder).with_context(|| format!("cannot create the folder {}", folder.display()))?;
    let replaced = || -> Result<()> {
        let attempt = attempt::begin(path, |attempt| File::create_new(attempt).map(drop))?;
        let written = write(&attempt).and_then(|()| flush(&attempt)).and_then(|()| Ok(fs::rename(&attempt, path)?));
        if written.is_err() {
            let _ = fs::remove_file(&attempt);
        }
        written?;
        flush(&folder)
    };
    replaced().map_err(full_disk).with_context(|| format!("cannot write {}", path.display()))
}

/// Removes the file at `path`, if it exists, and flushes its folder.
pub fn remove_file(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Ok(()) => flush(&parent(path)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error.into()),
    }
    .with_context(|| format!("cannot remove {}", path.display()))
}

/// Moves finished files, named relative to `attempt` with `/`, into `folder` beside existing files; removes `attempt`.
///
/// # Errors
/// A file cannot be moved (`NoSpace` if the disk is full); `attempt` cannot be removed.
pub fn move_files<'f>(attempt: &Path, folder: &Path, files: impl Iterator<Item = &'f str>) -> Result<()> {
    for file in files {
        let (from, to) = (attempt.join(file), folder.join(file));
        let moved = || -> Result<()> {
            fs::create_dir_all(parent(&to))?;
            flush(&from)?;
            fs::rename(&from, &to)?;
            flush(&parent(&to))
        };
        moved().map_err(full_disk).with_context(|| format!("cannot write {}", to.display()))?;
    }
    fs::remove_dir_all(attempt).with_context(|| format!("cannot remove {}", attempt.display()))
}

/// Returns whether `path` is a folder with entries, or a file.
pub fn has_files(path: &Path) -> bool {
    path.exists() && fs::read_dir(path).map_or(true, |mut entries| entries.next().is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/a.json");
        write_file(&path, b"old").unwrap();
        let failed = replace(&path, |attempt| {
            fs::write(attempt, b"half")?;
            anyhow::bail!("power cut")
        });
        assert!(failed.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn concurrent_writes_of_one_file_both_succeed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        replace(&path, |outer| {
            write_file(&path, b"inner")?;
            Ok(fs::write(outer, b"outer")?)
        })
        .unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"outer");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn full_disk_is_detected_under_any_context() {
        let io = std::io::Error::from(ErrorKind::StorageFull);
        let error = anyhow::Error::from(io).context("cannot write a");
        let text = format!("{error:#}");
        let found = full_disk(error);
        assert!(found.is::<NoSpace>() && format!("{found:#}") == text, "{found:#}");
        assert!(!full_disk(anyhow::anyhow!("other")).is::<NoSpace>());
    }
}
