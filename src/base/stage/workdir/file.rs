//! One file, or several into a folder that is there.

use super::attempt;
use super::disk::{flush, full_disk, parent};
use anyhow::{Context, Result};
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::Path;

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
}
