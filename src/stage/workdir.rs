//! Writing so that a kill at any moment leaves either the old or the new, whole: write an attempt beside the target,
//! flush it to disk, rename. The only renames of the project are here.

use anyhow::{Context, Result};
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Another program works in the folder.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("another run is at work in {}; wait for it to end", folder.display())]
pub struct BusyFolder {
    /// The folder with the lock.
    pub folder: PathBuf,
}

/// The disk is full, or a quota is used up.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct NoSpace(anyhow::Error);

/// Writes `bytes` to `path` atomically; its folder is made if missing.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    replace(path, |attempt| Ok(File::create(attempt)?.write_all(bytes)?))
}

/// Lets `write` make a file under an attempt name beside `path` (the same extension), then puts it in place.
/// If `write` fails, the attempt is removed and what was at `path` stays.
pub fn replace(path: &Path, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let folder = parent(path);
    fs::create_dir_all(&folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let attempt = attempt_beside(path);
    let written = write(&attempt).and_then(|()| flush(&attempt)).and_then(|()| {
        fs::rename(&attempt, path)?;
        flush(&folder)
    });
    if written.is_err() {
        let _ = fs::remove_file(&attempt);
    }
    written.map_err(full_disk).with_context(|| format!("cannot write {}", path.display()))
}

/// An error that comes of a full disk becomes `NoSpace` with the same text; any other stays.
pub(super) fn full_disk(error: anyhow::Error) -> anyhow::Error {
    let is_full = |error: &std::io::Error| matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded);
    let full = error.chain().filter_map(|cause| cause.downcast_ref()).any(is_full);
    if full { NoSpace(error).into() } else { error }
}

/// One program at a time writes in `folder`, made if missing: the lock goes with the process, however it ends. Errors
/// when another has it, or the folder cannot be written in.
pub fn lock(folder: &Path) -> Result<File> {
    let made = fs::create_dir_all(folder).and_then(|()| File::create(folder.join(".lock")));
    let file = made.with_context(|| format!("cannot write in {}", folder.display()))?;
    file.try_lock().map_err(|_| BusyFolder { folder: folder.to_owned() })?;
    Ok(file)
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

/// Puts the finished folder `attempt` in the place of `target`, which may exist. Every file is flushed first.
pub fn replace_folder(attempt: &Path, target: &Path) -> Result<()> {
    let moved = || -> Result<()> {
        flush_tree(attempt)?;
        if target.exists() {
            let old = attempt_beside(target).with_extension("old");
            let _ = fs::remove_dir_all(&old);
            fs::rename(target, &old)?;
            fs::rename(attempt, target)?;
            let _ = fs::remove_dir_all(&old);
        } else {
            fs::rename(attempt, target)?;
        }
        flush(&parent(target))
    };
    moved().map_err(full_disk).with_context(|| format!("cannot put {} in its place", target.display()))
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

/// Lets `write` fill an empty folder, then puts that in the place of `place`. If `write` fails, what was there stays.
pub fn build_folder<T>(place: &Path, write: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
    let attempt = attempt_folder(place)?;
    let written = write(&attempt).map_err(full_disk).and_then(|written| {
        replace_folder(&attempt, place)?;
        Ok(written)
    });
    if written.is_err() {
        let _ = fs::remove_dir_all(&attempt);
    }
    written
}

/// Whether something is in the folder at `path`, or `path` is a file.
pub fn has_files(path: &Path) -> bool {
    path.exists() && fs::read_dir(path).map_or(true, |mut entries| entries.next().is_some())
}

/// Puts back what `replace_folder` had moved aside when it was killed between its two renames.
pub fn restore_folder(target: &Path) -> Result<()> {
    let old = attempt_beside(target).with_extension("old");
    if target.exists() || !old.is_dir() {
        return Ok(());
    }
    fs::rename(&old, target).with_context(|| format!("cannot put {} back", target.display()))
}

/// What a killed attempt left beside `target`.
pub fn left_over(target: &Path) -> Vec<PathBuf> {
    let attempt = attempt_beside(target);
    [attempt.with_extension("old"), attempt].into_iter().filter(|path| path.exists()).collect()
}

/// An empty folder beside `target` to work in; what an earlier killed attempt left there is removed.
pub fn attempt_folder(target: &Path) -> Result<PathBuf> {
    let attempt = attempt_beside(target);
    let made = || -> std::io::Result<()> {
        for stale in [attempt.clone(), attempt.with_extension("old")] {
            match fs::remove_dir_all(&stale) {
                Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        fs::create_dir_all(&attempt)
    };
    made()
        .map_err(|error| full_disk(error.into()))
        .with_context(|| format!("cannot write in the work folder {}", parent(target).display()))?;
    Ok(attempt)
}

fn parent(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// `.NAME.attempt.EXT` beside `path`: hidden, and with the extension that writers choose their format by.
fn attempt_beside(path: &Path) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = match path.extension() {
        Some(extension) => format!(".{stem}.attempt.{}", extension.to_string_lossy()),
        None => format!(".{stem}.attempt"),
    };
    path.with_file_name(name)
}

fn flush(path: &Path) -> Result<()> {
    Ok(File::open(path)?.sync_all()?)
}

fn flush_tree(folder: &Path) -> Result<()> {
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
    fn a_full_disk_is_found_beneath_any_context() {
        let io = std::io::Error::from(ErrorKind::StorageFull);
        let error = anyhow::Error::from(io).context("cannot write a");
        let text = format!("{error:#}");
        let found = full_disk(error);
        assert!(found.is::<NoSpace>() && format!("{found:#}") == text, "{found:#}");
        assert!(!full_disk(anyhow::anyhow!("other")).is::<NoSpace>());
    }

    #[test]
    fn a_folder_replaces_another() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("unit");
        for round in ["1", "2"] {
            let attempt = attempt_folder(&target).unwrap();
            fs::write(attempt.join(round), round).unwrap();
            replace_folder(&attempt, &target).unwrap();
        }
        assert!(target.join("2").exists() && !target.join("1").exists());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
