//! The restriction as a whole.

use super::access::{FileAccess, Restriction};

/// Restricts this process for good: files as `access` says; no socket, no other program, no other process, no change of
/// the system. What the kernel cannot enforce is left out and named in the answer. A process that has several threads
/// already is left as it is, since only the calling one could be restricted.
#[cfg(target_os = "linux")]
pub fn restrict(access: &FileAccess) -> Restriction {
    let n_threads = std::fs::read_dir("/proc/self/task").map_or(1, Iterator::count);
    if n_threads > 1 {
        let late = || format!("the process had {n_threads} threads already");
        return Restriction { files: Err(late()), calls: Err(late()) };
    }
    restrict_thread(access)
}

/// Restricts this thread and those it starts, as `restrict` does a process; other threads of the process stay free.
#[cfg(target_os = "linux")]
pub fn restrict_thread(access: &FileAccess) -> Restriction {
    Restriction { files: super::files::restrict(access), calls: super::calls::restrict() }
}

/// Restricts nothing: there are ways for Linux alone.
#[cfg(not(target_os = "linux"))]
pub fn restrict(_access: &FileAccess) -> Restriction {
    let none = || "Landlock and seccomp are parts of Linux".to_owned();
    Restriction { files: Err(none()), calls: Err(none()) }
}
