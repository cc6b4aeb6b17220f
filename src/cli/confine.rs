//! Restriction of a verb that reads foreign files: from its start on it writes beside its outputs and locks alone, opens no
//! socket and starts no program.

use super::signals;
use orator_media::sandbox::{FileAccess, restrict};
use std::path::{Path, PathBuf};

/// Restricts this process for good, as far as the kernel can: it writes beneath the folders that hold `outputs`, and where
/// the locks of `locked` lie, which are folders or files in them. It comes before the verb reads a foreign file or starts
/// a thread.
pub fn confine<'p>(outputs: impl IntoIterator<Item = &'p Path>, locked: impl IntoIterator<Item = &'p Path>) {
    let outputs = outputs.into_iter().map(|output| std::path::absolute(output).unwrap_or_default());
    let locked = locked.into_iter().filter_map(|path| {
        let path = path.canonicalize().or_else(|_| std::path::absolute(path)).ok()?;
        if path.is_file() { path.parent().map(Path::to_owned) } else { Some(path) }
    });
    let writes = outputs.chain(locked).filter_map(|path| folder_of(&path)).collect();
    signals::prepare();
    // What the kernel does not enforce is said by `orator doctor`.
    let _ = restrict(&FileAccess { reads: None, writes });
}

/// The folder that holds `path`; of folders that are not made yet, the one above them that is there.
fn folder_of(path: &Path) -> Option<PathBuf> {
    path.ancestors().skip(1).find(|folder| folder.is_dir()).map(Path::to_owned)
}

/// The program to start once more as the process of a unit: this very file, also when it was replaced since.
pub fn this_program() -> PathBuf {
    let path = Path::new("/proc/self/exe");
    if path.exists() { path.to_owned() } else { std::env::current_exe().unwrap_or_else(|_| "orator".into()) }
}
