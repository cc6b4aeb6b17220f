//! Files that a restricted process can access, and a report of what the kernel enforces.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;

/// Files and folders that a restricted process can access; missing ones are skipped.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FileAccess {
    /// Paths that can be read, with everything below them, in addition to the system libraries; `None`: all files.
    pub reads: Option<Vec<PathBuf>>,
    /// Folders below which files can be created, written, renamed and removed.
    pub writes: Vec<PathBuf>,
}

/// Restrictions that the kernel enforces, or why it does not.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Restriction {
    /// File access: the Landlock version.
    pub files: Result<String, String>,
    /// System calls.
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
            (Ok(files), Err(calls)) => write!(f, "partly active: files by {files}, but not system calls: {calls}"),
            (Err(files), Ok(())) => write!(f, "partly active: system calls by seccomp, but not files: {files}"),
            (Err(files), Err(calls)) => write!(f, "not active: {files}; {calls}"),
        }
    }
}

/// Restricts this process permanently: file access as in `access`; no sockets, no other programs or processes, no
/// changes to the system. Restrictions that the kernel cannot enforce are skipped and named in the result. A process
/// that already has several threads is not restricted, since only the calling thread could be.
pub fn restrict(access: &FileAccess) -> Restriction {
    let n_threads = std::fs::read_dir("/proc/self/task").map_or(1, Iterator::count);
    if n_threads > 1 {
        let late = || format!("the process already had {n_threads} threads");
        return Restriction { files: Err(late()), calls: Err(late()) };
    }
    restrict_thread(access)
}

/// Restricts this thread and those that it starts, as [`restrict`] does for a process; other threads are unaffected.
pub fn restrict_thread(access: &FileAccess) -> Restriction {
    let calls = super::calls::restrict().map_err(|error| format!("seccomp: {error}"));
    Restriction { files: super::files::restrict(access), calls }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn display_names_missing_restrictions() {
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
