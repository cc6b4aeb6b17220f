//! Writing one file, or several into an existing folder; flushing to disk, and the error of a full one.

use super::attempt;
use anyhow::{Context, Result};
use rustix::fs::OFlags;
use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

/// The disk is full, or a quota is used up.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct NoSpace(anyhow::Error);

impl NoSpace {
    /// Wraps the error of the write that failed.
    pub fn new(error: anyhow::Error) -> Self {
        Self(error)
    }
}

/// An error that comes of a full disk becomes `NoSpace` with the same text; any other stays.
pub fn full_disk(error: anyhow::Error) -> anyhow::Error {
    let is_full = |error: &std::io::Error| matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded);
    let full = error.chain().filter_map(|cause| cause.downcast_ref()).any(is_full);
    if full { NoSpace(error).into() } else { error }
}

/// The folder that `path` lies in.
pub(crate) fn parent(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// Bytes of the files in a folder and all folders beneath it, as far as they can be seen.
pub fn bytes_under(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let bytes = |entry: fs::DirEntry| match entry.metadata() {
        Ok(meta) if meta.is_dir() => bytes_under(&entry.path()),
        Ok(meta) => meta.len(),
        Err(_) => 0,
    };
    entries.map(bytes).sum()
}

/// Waits until a file, or the list of a folder, is on the disk.
pub(crate) fn flush(path: &Path) -> Result<()> {
    Ok(File::open(path)?.sync_all()?)
}

/// Waits until all of a folder is on the disk.
pub(crate) fn flush_tree(folder: &Path) -> Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() { flush_tree(&path)? } else { flush(&path)? }
    }
    flush(folder)
}

/// The bytes of a file. Errors: those of `fs::read`; something else than a file, a named pipe too, for which nothing waits
/// (`ErrorKind::InvalidInput`, of a folder `IsADirectory`).
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

/// Writes `bytes` to `path` atomically; its folder is made if missing.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    replace(path, |attempt| Ok(File::create(attempt)?.write_all(bytes)?))
}

/// Lets `write` make a file under an attempt name beside `path` (the same extension), then puts it in place. An empty
/// file is there already. If `write` fails, the attempt is removed and what was at `path` stays.
pub fn replace(path: &Path, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let folder = parent(path);
    fs::create_dir_all(&folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
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

/// Removes the file at `path`, if there is one, and flushes its folder.
pub fn remove_file(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Ok(()) => flush(&parent(path)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error.into()),
    }
    .with_context(|| format!("cannot remove {}", path.display()))
}

/// Moves finished files, named with `/` between folders, from the folder `attempt` into `folder`, beside what is there;
/// `attempt` goes.
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

/// Whether something is in the folder at `path`, or `path` is a file.
pub fn has_files(path: &Path) -> bool {
    path.exists() && fs::read_dir(path).map_or(true, |mut entries| entries.next().is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_what_was_there() {
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
    fn two_that_write_one_file_at_once_both_end_well() {
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
    fn a_full_disk_is_found_beneath_any_context() {
        let io = std::io::Error::from(ErrorKind::StorageFull);
        let error = anyhow::Error::from(io).context("cannot write a");
        let text = format!("{error:#}");
        let found = full_disk(error);
        assert!(found.is::<NoSpace>() && format!("{found:#}") == text, "{found:#}");
        assert!(!full_disk(anyhow::anyhow!("other")).is::<NoSpace>());
    }
}
