//! A whole folder in the place of another: one exchange of names, or two renames where the file system has none.

use super::attempt;
use super::file::{flush, flush_tree, full_disk, parent};
use anyhow::{Context, Result};
use rustix::fs::{CWD, RenameFlags, renameat_with};
use rustix::io::Errno;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Exchanges two folders; `false`: the file system cannot.
type Exchange<'a> = &'a dyn Fn(&Path, &Path) -> io::Result<bool>;

/// Puts the finished folder `attempt` in the place of `target`, which may exist. Every file is flushed first.
pub fn replace_folder(attempt: &Path, target: &Path) -> Result<()> {
    let moved = || -> Result<()> {
        flush_tree(attempt)?;
        put(attempt, target, &exchange, &mut || Ok(()))
    };
    moved().map_err(full_disk).with_context(|| format!("cannot put {} in its place", target.display()))
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

/// An empty folder beside `target` to work in. What killed attempts left there is removed, after a replacement that was
/// killed halfway is taken back.
pub fn attempt_folder(target: &Path) -> Result<PathBuf> {
    restore_folder(target)?;
    let made = || -> io::Result<PathBuf> {
        fs::create_dir_all(parent(target))?;
        if target.symlink_metadata().is_ok() {
            attempt::remove(&attempt::moved_aside(target))?;
        }
        attempt::begin(target, |path| fs::create_dir(path))
    };
    made()
        .map_err(|error| full_disk(error.into()))
        .with_context(|| format!("cannot write {}: no folder can be made beside it", target.display()))
}

/// Ends what killed programs began at `target`: the folder is put back where it stood aside, attempts are removed. For who
/// has the folder, or the work folder, alone.
pub fn recover_folder(target: &Path) -> Result<()> {
    restore_folder(target)?;
    let remove = || -> io::Result<()> {
        if target.symlink_metadata().is_ok() {
            attempt::remove(&attempt::moved_aside(target))?;
        }
        attempt::sweep(target)
    };
    remove().with_context(|| format!("cannot remove what a killed program left beside {}", target.display()))
}

/// Puts back what `replace_folder` had moved aside when it was killed between its two renames.
pub fn restore_folder(target: &Path) -> Result<()> {
    let old = attempt::moved_aside(target);
    if target.symlink_metadata().is_ok() || !old.is_dir() {
        return Ok(());
    }
    match fs::rename(&old, target) {
        // Another reader was faster.
        Err(_) if target.symlink_metadata().is_ok() => Ok(()),
        renamed => renamed.with_context(|| format!("cannot put {} back", target.display())),
    }
}

fn exchange(a: &Path, b: &Path) -> io::Result<bool> {
    match renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE) {
        Ok(()) => Ok(true),
        // File systems without it, kernels without it, containers that forbid it.
        Err(Errno::INVAL | Errno::NOSYS | Errno::OPNOTSUPP | Errno::PERM) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

/// The renames of a replacement. `step` comes before each of them and before what follows; tests stop there.
fn put(attempt: &Path, target: &Path, exchange: Exchange, step: &mut dyn FnMut() -> io::Result<()>) -> Result<()> {
    let aside = attempt::moved_aside(target);
    step()?;
    let old = if target.symlink_metadata().is_err() {
        fs::rename(attempt, target)?;
        None
    } else if exchange(attempt, target)? {
        Some(attempt)
    } else {
        // With the target in its place this is no only copy.
        attempt::remove(&aside)?;
        step()?;
        fs::rename(target, &aside)?;
        if let Err(error) = step().and_then(|()| fs::rename(attempt, target)) {
            fs::rename(&aside, target)?;
            return Err(error.into());
        }
        Some(&*aside)
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

    /// The folder `target` with three files that say `text`.
    fn write(folder: &Path, text: &str) {
        FILES.iter().for_each(|file| fs::write(folder.join(file), text).unwrap());
    }

    /// What all three files say.
    fn read(folder: &Path) -> String {
        let texts = FILES.map(|file| fs::read_to_string(folder.join(file)).unwrap());
        assert!(texts[0] == texts[1] && texts[1] == texts[2], "{texts:?}");
        texts[0].clone()
    }

    /// Replaces "old" by "new" and stops at a step, as a kill does (`dies`) or a disk that fails. Returns the folder, and
    /// whether the step was reached.
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
    fn a_replacement_stopped_at_any_step_leaves_the_old_or_the_new_whole() {
        let two_renames = |_: &Path, _: &Path| Ok(false);
        let ways: [(Exchange, usize); 2] = [(&exchange, 3), (&two_renames, 5)];
        for (way, n_steps) in ways {
            for dies in [false, true] {
                let mut seen = Vec::new();
                for at in 0..n_steps {
                    let (dir, is_stopped) = stopped(at, dies, way);
                    assert!(is_stopped, "step {at} of {n_steps}");
                    let target = dir.path().join("host");
                    if dies {
                        // What any start does first, a reader's and a writer's.
                        restore_folder(&target).unwrap();
                    }
                    seen.push(read(&target));
                    let attempt = attempt_folder(&target).unwrap();
                    assert_eq!(read(&target), seen[at], "the only copy was removed");
                    write(&attempt, "newer");
                    replace_folder(&attempt, &target).unwrap();
                    assert_eq!(read(&target), "newer");
                    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1, "nothing is left beside");
                    assert!(!target.join("of the old").exists());
                    assert!(target.symlink_metadata().unwrap().is_dir());
                }
                assert!(seen[0] == "old" && seen.last().unwrap() == "new", "{seen:?}");
                assert!(!stopped(n_steps, dies, way).1);
            }
        }
    }

    #[test]
    fn an_attempt_takes_back_what_was_moved_aside() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("host.v2");
        let aside = attempt::moved_aside(&target);
        fs::create_dir(&aside).unwrap();
        write(&aside, "old");
        attempt_folder(&target).unwrap();
        assert_eq!(read(&target), "old");
        assert!(!aside.exists());
    }
}
