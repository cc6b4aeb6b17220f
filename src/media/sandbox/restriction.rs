//! The restriction as a whole: what a restricted process may still do with files, and what the kernel enforces of it.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;

/// Files and folders that a restricted process still reaches; what does not exist is passed over.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FileAccess {
    /// Read, with all beneath them, besides the libraries of the system; `None`: everything.
    pub reads: Option<Vec<PathBuf>>,
    /// Folders beneath which files are made, written, renamed and removed.
    pub writes: Vec<PathBuf>,
}

/// What the kernel enforces, or why it does not.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Restriction {
    /// Of files: the version of Landlock.
    pub files: Result<String, String>,
    /// Of system calls.
    pub calls: Result<(), String>,
}

impl Restriction {
    /// Whether files and system calls are both restricted.
    pub fn is_active(&self) -> bool {
        self.files.is_ok() && self.calls.is_ok()
    }
}

impl fmt::Display for Restriction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.files, &self.calls) {
            (Ok(files), Ok(())) => write!(f, "active: files by {files}, system calls by seccomp"),
            (Ok(files), Err(calls)) => write!(f, "active in part: files by {files}, not system calls: {calls}"),
            (Err(files), Ok(())) => write!(f, "active in part: system calls by seccomp, not files: {files}"),
            (Err(files), Err(calls)) => write!(f, "not active: {files}; {calls}"),
        }
    }
}

/// Restricts this process for good: files as `access` says; no socket, no other program, no other process, no change of
/// the system. What the kernel cannot enforce is left out and named in the answer. A process that has several threads
/// already is left as it is, since only the calling one could be restricted.
pub fn restrict(access: &FileAccess) -> Restriction {
    let n_threads = std::fs::read_dir("/proc/self/task").map_or(1, Iterator::count);
    if n_threads > 1 {
        let late = || format!("the process had {n_threads} threads already");
        return Restriction { files: Err(late()), calls: Err(late()) };
    }
    restrict_thread(access)
}

/// Restricts this thread and those it starts, as `restrict` does a process; other threads of the process stay free.
pub fn restrict_thread(access: &FileAccess) -> Restriction {
    let calls = super::calls::restrict().map_err(|error| format!("seccomp: {error}"));
    Restriction { files: super::files::restrict(access), calls }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_answer_names_what_is_missing() {
        let of = |files: Result<&str, &str>, calls: Result<(), &str>| Restriction {
            files: files.map(str::to_owned).map_err(str::to_owned),
            calls: calls.map_err(str::to_owned),
        };
        assert_eq!(of(Ok("Landlock"), Ok(())).to_string(), "active: files by Landlock, system calls by seccomp");
        let half = of(Err("no Landlock"), Ok(()));
        assert!(!half.is_active() && half.to_string().ends_with("not files: no Landlock"));
        assert_eq!(of(Err("a"), Err("b")).to_string(), "not active: a; b");
    }
}
