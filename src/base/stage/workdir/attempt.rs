//! Names of attempts: hidden, beside their target, with the extension that writers choose their format by, and no two
//! alike (`.NAME.attempt-PROCESS-NUMBER.EXT`), so that programs that write the same file never share an attempt. What
//! a killed program left is removed by the next attempt at the same target.

use super::file::parent;
use rustix::io::Errno;
use rustix::process::{Pid, test_kill_process};
use std::ffi::OsString;
use std::fs;
use std::io::{ErrorKind, Result};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

/// A file that changed within this time may belong to a program on another machine.
const RECENT: Duration = Duration::from_secs(60);

/// Makes an attempt beside `target` by `create`, which must fail where something is, a link too.
pub(crate) fn begin(target: &Path, create: impl Fn(&Path) -> Result<()>) -> Result<PathBuf> {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    sweep(target)?;
    let [start, end] = name_parts(target);
    loop {
        let mut name = start.clone();
        name.push(format!("-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed)));
        name.push(&end);
        let path = target.with_file_name(name);
        match create(&path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            made => return made.map(|()| path),
        }
    }
}

/// Removes what killed programs left of their attempts at `target`.
pub(crate) fn sweep(target: &Path) -> Result<()> {
    let mut stale = attempts(target).into_iter().filter(|(path, process)| is_stale(path, *process));
    stale.try_for_each(|(path, _)| remove(&path))
}

/// Where the folder `target` stands while two renames put another in its place.
pub(crate) fn moved_aside(target: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(target.file_name().unwrap_or_default());
    name.push(".old");
    target.with_file_name(name)
}

/// What killed attempts left beside `target`, and those of programs at work.
pub fn left_over(target: &Path) -> Vec<PathBuf> {
    let old = Some(moved_aside(target)).filter(|old| old.symlink_metadata().is_ok());
    old.into_iter().chain(attempts(target).into_iter().map(|(path, _)| path)).collect()
}

/// Removes a file, a link or a folder; nothing there is no error.
pub fn remove(path: &Path) -> Result<()> {
    let is_folder = path.symlink_metadata().is_ok_and(|meta| meta.is_dir());
    match if is_folder { fs::remove_dir_all(path) } else { fs::remove_file(path) } {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Whether a process of that number is at work on this machine.
pub fn is_alive(process: u32) -> bool {
    let pid = i32::try_from(process).ok().and_then(Pid::from_raw);
    pid.is_some_and(|pid| test_kill_process(pid) != Err(Errno::SRCH))
}

/// The attempts at `target`, sorted, with the processes in their names; earlier versions wrote none.
fn attempts(target: &Path) -> Vec<(PathBuf, Option<u32>)> {
    let [start, end] = name_parts(target);
    let entries = fs::read_dir(parent(target)).into_iter().flatten().flatten();
    let parsed = |name: OsString| {
        let rest = name.as_encoded_bytes().strip_prefix(start.as_encoded_bytes())?;
        let rest = std::str::from_utf8(rest.strip_suffix(end.as_encoded_bytes())?).ok()?;
        let process = match rest.strip_prefix('-').and_then(|rest| rest.split_once('-')) {
            Some((process, number)) => number.parse::<u64>().ok().and_then(|_| process.parse().ok()).map(Some)?,
            None => rest.is_empty().then_some(None)?,
        };
        Some((target.with_file_name(name), process))
    };
    let mut found: Vec<_> = entries.filter_map(|entry| parsed(entry.file_name())).collect();
    found.sort();
    found
}

/// The name of an attempt before and after its numbers.
fn name_parts(target: &Path) -> [OsString; 2] {
    let (mut start, mut end) = (OsString::from("."), OsString::new());
    start.push(target.file_stem().unwrap_or_default());
    start.push(".attempt");
    if let Some(extension) = target.extension() {
        end.push(".");
        end.push(extension);
    }
    [start, end]
}

/// Whether nobody goes on with an attempt. A folder is attempted under a lock, so that its programs are of this machine;
/// one process makes one attempt at a time, and a number may come again after a restart.
fn is_stale(path: &Path, process: Option<u32>) -> bool {
    let is_at_work = process.is_some_and(|process| process != std::process::id() && is_alive(process));
    let Ok(meta) = path.symlink_metadata() else { return false };
    let age = meta.modified().ok().and_then(|time| SystemTime::now().duration_since(time).ok());
    !is_at_work && (meta.is_dir() || age.is_some_and(|age| age >= RECENT))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::File;

    fn create(path: &Path) -> Result<()> {
        File::create_new(path).map(drop)
    }

    /// The number of a process that has ended.
    fn ended_process() -> u32 {
        let mut child = std::process::Command::new("true").spawn().unwrap();
        child.wait().unwrap();
        child.id()
    }

    #[test]
    fn no_two_attempts_are_alike_and_those_of_the_dead_go() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("q.mp4");
        let dead = ended_process();
        let names = [".q.attempt.mp4".to_owned(), format!(".q.attempt-{dead}-3.mp4"), ".q.attempt-1-1.mp4".to_owned()];
        for name in
            names.iter().map(String::as_str).chain([".q.attempt-x-1.mp4", ".q.attempt-1-1.m4v", ".qq.attempt.mp4"])
        {
            let file = File::create(dir.path().join(name)).unwrap();
            file.set_modified(SystemTime::now() - 2 * RECENT).unwrap();
        }
        let young = dir.path().join(format!(".q.attempt-{dead}-4.mp4"));
        create(&young).unwrap();
        assert_eq!(left_over(&target).len(), 4);
        let (a, b) = (begin(&target, create).unwrap(), begin(&target, create).unwrap());
        assert!(a != b && a.extension() == target.extension());
        let mut left = left_over(&target);
        left.retain(|path| ![&a, &b].contains(&path));
        // Process 1 is at work everywhere; the young one may be of another machine.
        assert_eq!(left, [dir.path().join(".q.attempt-1-1.mp4"), young]);
    }

    #[test]
    fn a_planted_link_is_not_written_through() {
        let dir = tempfile::tempdir().unwrap();
        let (target, victim) = (dir.path().join("a.json"), dir.path().join("victim"));
        fs::write(&victim, "precious").unwrap();
        for number in 0..200 {
            let name = format!(".a.attempt-{}-{number}.json", std::process::id());
            std::os::unix::fs::symlink(&victim, dir.path().join(name)).unwrap();
        }
        super::super::write_file(&target, b"new").unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"new");
        assert_eq!(fs::read_to_string(&victim).unwrap(), "precious");
        assert!(!target.symlink_metadata().unwrap().is_symlink());
    }
}
