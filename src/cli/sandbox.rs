//! Sandbox of verbs that read untrusted files: they may write only next to their outputs and locks, and may not open
//! sockets or start programs.

use super::signals;
use orator_media::sandbox::{FileAccess, restrict};
use std::path::{Path, PathBuf};

/// Restricts this process permanently, as far as the kernel supports it: it may write below the folders that contain
/// `outputs` and the locks of `locked`, which are folders or files in them. Call this before reading untrusted files or
/// starting threads.
pub fn enter_sandbox<'p>(outputs: impl IntoIterator<Item = &'p Path>, locked: impl IntoIterator<Item = &'p Path>) {
    let outputs = outputs.into_iter().map(|output| std::path::absolute(output).unwrap_or_default());
    let locked = locked.into_iter().filter_map(|path| {
        let path = path.canonicalize().or_else(|_| std::path::absolute(path)).ok()?;
        if path.is_file() { path.parent().map(Path::to_owned) } else { Some(path) }
    });
    let writes = outputs.chain(locked).filter_map(|path| folder_of(&path)).collect();
    signals::prepare();
    // `orator doctor` reports what the kernel does not enforce.
    let _ = restrict(&FileAccess { reads: None, writes });
}

/// The folder that contains `path`, or the nearest existing folder above it.
fn folder_of(path: &Path) -> Option<PathBuf> {
    path.ancestors().skip(1).find(|folder| folder.is_dir()).map(Path::to_owned)
}

/// The program to start as the subprocess of a unit: the running executable, even if its file was replaced.
pub fn this_program() -> PathBuf {
    let path = Path::new("/proc/self/exe");
    if path.exists() { path.to_owned() } else { std::env::current_exe().unwrap_or_else(|_| "orator".into()) }
}
