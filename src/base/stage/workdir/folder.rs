//! Replacing a folder by another: an atomic exchange of names, or two renames where the file system lacks it.

use super::attempt;
use super::file::{flush, flush_tree, full_disk, parent};
use anyhow::{Context, Result};
use rustix::fs::{CWD, RenameFlags, renameat_with};
use rustix::io::Errno;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Exchanges two folders; returns `false` if the file system does not support it.
type Exchange<'a> = &'a dyn Fn(&Path, &Path) -> io::Result<bool>;

/// Replaces `target`, which may be missing, by the finished folder `attempt`, after flushing every file to disk.
pub fn replace_folder(attempt: &Path, target: &Path) -> Result<()> {
    let moved = || -> Result<()> {
        flush_tree(attempt)?;
        put(attempt, target, &exchange, &mut || Ok(()))
    };
    moved().map_err(full_disk).with_context(|| format!("cannot replace {}", target.display()))
}

/// Calls `write` with an empty folder to fill, which then replaces `target`.
///
/// # Errors
/// Those of `write`; a file operation fails (`NoSpace` if the disk is full). `target` is then unchanged.
pub fn build_folder<T>(target: &Path, write: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
    let attempt = attempt_folder(target)?;
    let written = write(&attempt).map_err(full_disk).and_then(|written| {
        replace_folder(&attempt, target)?;
        Ok(written)
    });
    if written.is_err() {
        let _ = fs::remove_dir_all(&attempt);
    }
    written
}

/// Creates an empty working folder beside `target`. First undoes a replacement that was killed halfway, and removes
/// what killed attempts left beside `target`.
pub fn attempt_folder(target: &Path) -> Result<PathBuf> {
    restore_folder(target)?;
    let create = || -> io::Result<PathBuf> {
        fs::create_dir_all(parent(target))?;
        if target.symlink_metadata().is_ok() {
            attempt::remove(&attempt::backup_path(target))?;
        }
        attempt::begin(target, |path| fs::create_dir(path))
    };
    create()
        .map_err(|error| full_disk(error.into()))
        .with_context(|| format!("cannot write {}: no folder can be created beside it", target.display()))
}

/// Recovers from programs that were killed while replacing `target`: moves the folder back to its path and removes
/// attempts. The caller must hold an exclusive lock on the folder or on the work folder.
pub fn recover_folder(target: &Path) -> Result<()> {
    restore_folder(target)?;
    let remove = || -> io::Result<()> {
        if target.symlink_metadata().is_ok() {
            attempt::remove(&attempt::backup_path(target))?;
        }
        attempt::sweep(target)
    };
    remove()
        .with_context(|| format!("cannot remove the temporary files of a killed program beside {}", target.display()))
}

/// Moves the folder back that `replace_folder` had renamed when it was killed between its two renames.
pub fn restore_folder(target: &Path) -> Result<()> {
    let old = attempt::backup_path(target);
    if target.symlink_metadata().is_ok() || !old.is_dir() {
        return Ok(());
    }
    match fs::rename(&old, target) {
        // Another reader has restored it first.
        Err(_) if target.symlink_metadata().is_ok() => Ok(()),
        renamed => renamed.with_context(|| format!("cannot restore {}", target.display())),
    }
}

fn exchange(a: &Path, b: &Path) -> io::Result<bool> {
    match renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE) {
        Ok(()) => Ok(true),
        // File systems or kernels that do not support it, and containers that forbid it.
        Err(Errno::INVAL | Errno::NOSYS | Errno::OPNOTSUPP | Errno::PERM) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

/// Replaces `target`. `step` is called before each file operation, so that tests can stop there.
fn put(attempt: &Path, target: &Path, exchange: Exchange, step: &mut dyn FnMut() -> io::Result<()>) -> Result<()> {
    let backup = attempt::backup_path(target);
    step()?;
    let old = if target.symlink_metadata().is_err() {
        fs::rename(attempt, target)?;
        None
    } else if exchange(attempt, target)? {
        Some(attempt)
    } else {
        // `target` exists, so `backup` is not the only copy.
        attempt::remove(&backup)?;
        step()?;
        fs::rename(target, &backup)?;
        if let Err(error) = step().and_then(|()| fs::rename(attempt, target)) {
            fs::rename(&backup, target)?;
            return Err(error.into());
        }
        Some(&*backup)
    };
    step()?;
    flush(&parent(target))?;
    step()?;
    if let Some(old) = old {
        // What cannot be removed now is removed by the next attempt.
        let _ = attempt::remove(old);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::panic::{AssertUnwindSafe, catch_unwind};

    const FILES: [&str; 3] = ["1", "2", "3"];

    /// Writes three files with the content `text`.
    fn write(folder: &Path, text: &str) {
        FILES.iter().for_each(|file| fs::write(folder.join(file), text).unwrap());
    }

    /// Returns the content of the three files, which must be equal.
    fn read(folder: &Path) -> String {
        let texts = FILES.map(|file| fs::read_to_string(folder.join(file)).unwrap());
        assert!(texts[0] == texts[1] && texts[1] == texts[2], "{texts:?}");
        texts[0].clone()
    }

    /// Replaces "old" by "new" and stops at step `at`, by a kill (`dies`) or by a disk error. Returns the parent
    /// folder, and whether the step was reached.
    fn stopped(at: usize, dies: bool, exchange: Exchange) -> (tempfile::TempDir, bool) {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("host");
        let attempt = attempt_folder(&target).unwrap();
        write(&attempt, "old");
        fs::write(attempt.join("of the old"), "").unwrap();
        replace_folder(&attempt, &target).unwrap();
        let attempt = attempt_folder(&target).unwrap();
        write(&attempt, "new");
        let mut n = 0;
        let mut step = || {
            n += 1;
            assert!(n != at + 1 || !dies, "killed");
            if n == at + 1 { Err(io::Error::from(Errno::IO)) } else { Ok(()) }
        };
        let ended = catch_unwind(AssertUnwindSafe(|| put(&attempt, &target, exchange, &mut step)));
        assert_eq!(ended.is_err(), dies && n > at, "only a kill panics");
        (dir, n > at)
    }

    #[test]
    fn replacement_stopped_at_any_step_leaves_a_complete_folder() {
        let two_renames = |_: &Path, _: &Path| Ok(false);
        let ways: [(Exchange, usize); 2] = [(&exchange, 3), (&two_renames, 5)];
        for (way, n_steps) in ways {
            for dies in [false, true] {
                let mut contents = Vec::new();
                for at in 0..n_steps {
                    let (dir, is_stopped) = stopped(at, dies, way);
                    assert!(is_stopped, "step {at} of {n_steps}");
                    let target = dir.path().join("host");
                    if dies {
                        // Readers and writers do this first.
                        restore_folder(&target).unwrap();
                    }
                    contents.push(read(&target));
                    let attempt = attempt_folder(&target).unwrap();
                    assert_eq!(read(&target), contents[at], "the only copy was removed");
                    write(&attempt, "newer");
                    replace_folder(&attempt, &target).unwrap();
                    assert_eq!(read(&target), "newer");
                    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1, "nothing is left beside");
                    assert!(!target.join("of the old").exists());
                    assert!(target.symlink_metadata().unwrap().is_dir());
                }
                assert!(contents[0] == "old" && contents.last().unwrap() == "new", "{contents:?}");
                assert!(!stopped(n_steps, dies, way).1);
            }
        }
    }

    #[test]
    fn attempt_folder_restores_a_folder_from_its_backup() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("host.v2");
        let backup = attempt::backup_path(&target);
        fs::create_dir(&backup).unwrap();
        write(&backup, "old");
        attempt_folder(&target).unwrap();
        assert_eq!(read(&target), "old");
        assert!(!backup.exists());
    }
}
