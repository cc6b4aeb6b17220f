//! Restriction of a verb that reads foreign files: from its start on it writes beside its outputs alone, opens no socket and
//! starts no program.

use orator::external::sandbox::{FileAccess, restrict};
use std::path::{Path, PathBuf};

/// Restricts this process for good, as far as the kernel can, to writes beneath the folders that hold `outputs`. It comes
/// before the verb reads a foreign file or starts a thread.
pub fn confine<'p>(outputs: impl IntoIterator<Item = &'p Path>) {
    let writes = outputs.into_iter().map(folder_of).collect();
    // What the kernel does not enforce is said by `orator doctor`.
    let _ = restrict(&FileAccess { reads: None, writes });
}

/// The folder in which `output` is made; of folders that are made too, the one above them that exists.
fn folder_of(output: &Path) -> PathBuf {
    let output = std::path::absolute(output).unwrap_or_else(|_| output.to_owned());
    output.ancestors().skip(1).find(|folder| folder.is_dir()).unwrap_or(Path::new("/nonexistent")).to_owned()
}

/// The program to start once more as the process of a unit: this very file, also when it was replaced since.
pub fn this_program() -> PathBuf {
    let path = Path::new("/proc/self/exe");
    if path.exists() { path.to_owned() } else { std::env::current_exe().unwrap_or_else(|_| "orator".into()) }
}
