//! Commands for external programs. They run in a folder other than the user's, so that nothing in the user's working
//! directory is executed, loaded or read as configuration.

use anyhow::{Context, Result};
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

/// Creates an empty folder for a program that needs no files of its own; dropping the value removes it.
pub fn empty_folder() -> Result<TempDir> {
    let temp_dir = std::env::temp_dir();
    tempfile::tempdir().with_context(|| format!("cannot create a temporary folder in {} (TMPDIR)", temp_dir.display()))
}

/// Returns a command that runs `program` in `folder`. The child looks up a bare name in PATH after it has changed to
/// `folder`, so that a relative entry of PATH does not point into the working directory. A relative path is resolved
/// against the working directory. Symbolic links in it are not resolved, because the Python of a virtual environment
/// finds its packages by the link.
pub fn command_in(folder: &Path, program: &Path) -> Result<Command> {
    let is_path = program.as_os_str().as_encoded_bytes().contains(&b'/');
    let mut command = if is_path { Command::new(std::path::absolute(program)?) } else { Command::new(program) };
    command.current_dir(folder).env("PWD", folder);
    Ok(command)
}
