//! Names of attempts: hidden, beside their target, with the target's extension (by which writers choose a format), and
//! unique (`.NAME.attempt-PROCESS-START-MACHINE-NUMBER.EXT`), so that programs that write the same file never share an
//! attempt. What a killed program left is removed by the next attempt at that target and the next run (`sweep_folder`).

use super::file::parent;
use super::process::{is_alive, machine, started};
use std::ffi::OsString;
use std::fs;
use std::io::{ErrorKind, Result};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

/// Age below which an attempt of an unknown process may still be in progress: the process may run on another machine,
/// whose clock may differ by hours.
const RECENT: Duration = Duration::from_secs(24 * 60 * 60);

/// Creates an attempt beside `target` with `create`, which must fail if anything exists at the path, including a link.
pub(crate) fn begin(target: &Path, create: impl Fn(&Path) -> Result<()>) -> Result<PathBuf> {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    sweep(target)?;
    let [start, end] = name_parts(target);
    loop {
        let mut name = start.clone();
        name.push(format!("-{}-{}", Owner::this().marks(), NEXT.fetch_add(1, Ordering::Relaxed)));
        name.push(&end);
        let path = target.with_file_name(name);
        match create(&path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            made => return made.map(|()| path),
        }
    }
}

/// Removes what killed programs left of their attempts at `target`. A folder is attempted under a lock and by only one
/// thread of a process at a time, so an attempt at a folder by this or by an unknown process is left over.
pub(crate) fn sweep(target: &Path) -> Result<()> {
    let is_folder = |path: &Path| path.symlink_metadata().is_ok_and(|meta| meta.is_dir());
    let this = Owner::this();
    let is_stale =
        |path: &Path, owner: Option<&Owner>| match owner.filter(|owner| **owner != this).and_then(Owner::is_working) {
            Some(is_working) => !is_working,
            None => is_folder(path) || is_old(path),
        };
    let mut stale = attempts(target).into_iter().filter(|(path, owner)| is_stale(path, owner.as_ref()));
    stale.try_for_each(|(path, _)| remove(&path))
}

/// Removes what killed programs left in `folder` and, `depth` levels deep, in its subfolders, for every target,
/// because a target may never be attempted again. What cannot be removed is left to the next run.
pub fn sweep_folder(folder: &Path, depth: usize) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let (path, name) = (entry.path(), entry.file_name());
        let marks = name.to_str().filter(|name| name.starts_with('.')).and_then(|name| name.rsplit_once(".attempt-"));
        match marks.and_then(|(_, marks)| Owner::parse(marks.split('.').next()?)) {
            Some(owner) if !owner.is_working().unwrap_or_else(|| !is_old(&path)) => drop(remove(&path)),
            None if depth > 0 && entry.file_type().is_ok_and(|kind| kind.is_dir()) => sweep_folder(&path, depth - 1),
            _ => {}
        }
    }
}

/// Path of the folder `target` while two renames replace it.
pub(crate) fn backup_path(target: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(target.file_name().unwrap_or_default());
    name.push(".old");
    target.with_file_name(name)
}

/// Lists what killed attempts left beside `target`, and the attempts of running programs.
pub fn left_over(target: &Path) -> Vec<PathBuf> {
    let old = Some(backup_path(target)).filter(|old| old.symlink_metadata().is_ok());
    old.into_iter().chain(attempts(target).into_iter().map(|(path, _)| path)).collect()
}

/// Removes a file, a link or a folder; a missing path is not an error.
pub fn remove(path: &Path) -> Result<()> {
    let is_folder = path.symlink_metadata().is_ok_and(|meta| meta.is_dir());
    match if is_folder { fs::remove_dir_all(path) } else { fs::remove_file(path) } {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// The process that created an attempt, as encoded in the attempt's name.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Owner {
    process: u32,
    /// Start time, because process ids are reused, and machine. `None`: written by an earlier version, or unknown.
    origin: Option<(u64, String)>,
}

impl Owner {
    fn this() -> Self {
        let process = std::process::id();
        let origin = started(process).zip(Some(machine()).filter(|machine| !machine.is_empty()));
        Self { process, origin: origin.map(|(start, machine)| (start, machine.to_owned())) }
    }

    fn marks(&self) -> String {
        match &self.origin {
            Some((start, machine)) => format!("{}-{start}-{machine}", self.process),
            None => self.process.to_string(),
        }
    }

    /// Parses the process marks and the attempt number of a name.
    fn parse(text: &str) -> Option<Self> {
        let (marks, number) = text.rsplit_once('-')?;
        let _: u64 = number.parse().ok()?;
        let mut parts = marks.split('-');
        let process = parts.next()?.parse().ok()?;
        let origin = match (parts.next(), parts.next(), parts.next()) {
            (None, ..) => None,
            (Some(start), Some(machine), None) => Some((start.parse().ok()?, machine.to_owned())),
            _ => return None,
        };
        Some(Self { process, origin })
    }

    /// Returns whether the process is still working on the attempt; `None`: it may have run on another machine.
    fn is_working(&self) -> Option<bool> {
        match &self.origin {
            Some((start, on)) if on == machine() => {
                Some(is_alive(self.process) && started(self.process).is_none_or(|now| now == *start))
            }
            Some(_) => None,
            // Such a process made one attempt at a time, and its id may have been reused after a restart.
            None => Some(true).filter(|_| self.process != std::process::id() && is_alive(self.process)),
        }
    }
}

/// Lists the attempts at `target`, sorted, with the process encoded in each name; the earliest versions encoded none.
fn attempts(target: &Path) -> Vec<(PathBuf, Option<Owner>)> {
    let [start, end] = name_parts(target);
    let entries = fs::read_dir(parent(target)).into_iter().flatten().flatten();
    let parsed = |name: OsString| {
        let rest = name.as_encoded_bytes().strip_prefix(start.as_encoded_bytes())?;
        let rest = std::str::from_utf8(rest.strip_suffix(end.as_encoded_bytes())?).ok()?;
        let owner = if rest.is_empty() { None } else { Some(Owner::parse(rest.strip_prefix('-')?)?) };
        Some((target.with_file_name(name), owner))
    };
    let mut found: Vec<_> = entries.filter_map(|entry| parsed(entry.file_name())).collect();
    found.sort();
    found
}

/// Returns the parts of an attempt's name before and after its numbers.
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

/// Returns whether nothing at `path`, a file or a folder with its files, has changed for at least `RECENT`. A
/// modification time in the future is not old.
fn is_old(path: &Path) -> bool {
    let Ok(meta) = path.symlink_metadata() else { return false };
    let age = meta.modified().ok().and_then(|time| SystemTime::now().duration_since(time).ok());
    // A folder's own time does not change while a file in it is written.
    let mut files = Some(path).filter(|_| meta.is_dir()).and_then(|path| path.read_dir().ok()).into_iter().flatten();
    age.is_some_and(|age| age >= RECENT) && files.all(|file| file.is_ok_and(|file| is_old(&file.path())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::File;

    fn create(path: &Path) -> Result<()> {
        File::create_new(path).map(drop)
    }

    fn ended_process() -> u32 {
        let mut child = std::process::Command::new("true").spawn().unwrap();
        child.wait().unwrap();
        child.id()
    }

    #[test]
    fn attempts_are_unique_and_those_of_ended_processes_are_removed() {
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
        let recent = dir.path().join(format!(".q.attempt-{dead}-4.mp4"));
        create(&recent).unwrap();
        assert_eq!(left_over(&target).len(), 4);
        let (a, b) = (begin(&target, create).unwrap(), begin(&target, create).unwrap());
        assert!(a != b && a.extension() == target.extension());
        let mut left = left_over(&target);
        left.retain(|path| ![&a, &b].contains(&path));
        // Process 1 runs on every machine; the recent attempt of an earlier version may be from another machine.
        assert_eq!(left, [dir.path().join(".q.attempt-1-1.mp4"), recent]);
    }

    /// Sets the modification time of a file or folder to `secs` from now.
    fn change(path: &Path, secs: i64) {
        let by = Duration::from_secs(secs.unsigned_abs());
        let time = if secs < 0 { SystemTime::now() - by } else { SystemTime::now() + by };
        File::open(path).unwrap().set_modified(time).unwrap();
    }

    #[test]
    fn only_attempts_of_ended_processes_are_removed_despite_clock_skew() {
        let dir = tempfile::tempdir().unwrap();
        let (own, here) = (std::process::id(), machine());
        let (dead, start) = (ended_process(), started(own).unwrap());
        let old = -(RECENT.as_secs() as i64) - 1;
        // An earlier process had the same id as this one.
        let reused = format!("{own}-{}-{here}-1", start - 1);
        let elsewhere = format!("{own}-{start}-ffffffffffffffff");
        let cases = [
            (format!("{dead}-1-{here}-1"), 0, true),
            (format!("{dead}-1-{here}-2"), 3600, true),
            (reused, 0, true),
            (format!("{own}-{start}-{here}-1"), old, false),
            (format!("{elsewhere}-1"), -3600, false),
            (format!("{elsewhere}-2"), 3600, false),
            (format!("{elsewhere}-3"), old, true),
            (format!("{dead}-1"), -3600, false),
            (format!("{dead}-2"), old, true),
        ];
        for is_folder in [false, true] {
            let (folder, other) = (dir.path().join("stage/host"), dir.path().join("a/b/c"));
            let paths: Vec<PathBuf> =
                cases.iter().map(|(marks, ..)| folder.join(format!(".a.attempt-{marks}.npz"))).collect();
            let plant = |path: &Path| {
                fs::create_dir_all(path.parent().unwrap()).unwrap();
                if is_folder { fs::create_dir(path).unwrap() } else { create(path).unwrap() }
            };
            paths.iter().zip(&cases).for_each(|(path, (_, secs, _))| {
                plant(path);
                change(path, *secs);
            });
            let deep = other.join(format!(".a.attempt-{dead}-1-{here}-1.npz"));
            plant(&deep);
            sweep_folder(dir.path(), 2);
            for (path, (_, _, goes)) in paths.iter().zip(&cases) {
                assert_eq!(path.exists(), !goes, "{}", path.display());
            }
            assert!(deep.exists(), "deeper than asked for");
            if is_folder {
                let written = folder.join(format!(".a.attempt-{elsewhere}-4.npz"));
                plant(&written.join("now"));
                change(&written, old);
                sweep_folder(dir.path(), 2);
                assert!(written.exists(), "a file in it was written just now");
            }
            fs::remove_dir_all(dir.path().join("stage")).unwrap();
            fs::remove_dir_all(dir.path().join("a")).unwrap();
        }
    }

    #[test]
    fn a_planted_link_is_not_written_through() {
        let dir = tempfile::tempdir().unwrap();
        let (target, victim) = (dir.path().join("a.json"), dir.path().join("victim"));
        fs::write(&victim, "precious").unwrap();
        for number in 0..200 {
            let name = format!(".a.attempt-{}-{number}.json", Owner::this().marks());
            std::os::unix::fs::symlink(&victim, dir.path().join(name)).unwrap();
        }
        super::super::write_file(&target, b"new").unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"new");
        assert_eq!(fs::read_to_string(&victim).unwrap(), "precious");
        assert!(!target.symlink_metadata().unwrap().is_symlink());
    }
}
