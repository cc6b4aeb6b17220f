//! Flushing to disk, and the error of a full one.

use anyhow::Result;
use std::fs::{self, File};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The disk is full, or a quota is used up.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct NoSpace(anyhow::Error);

impl NoSpace {
    /// The error that came of it.
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
pub fn parent(path: &Path) -> PathBuf {
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
pub fn flush(path: &Path) -> Result<()> {
    Ok(File::open(path)?.sync_all()?)
}

/// Waits until all of a folder is on the disk.
pub fn flush_tree(folder: &Path) -> Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() { flush_tree(&path)? } else { flush(&path)? }
    }
    flush(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

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
