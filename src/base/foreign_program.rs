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

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn relative_program_paths_are_resolved_and_links_are_not() {
        let dir = tempfile::tempdir().unwrap();
        symlink("/bin/sh", dir.path().join("link")).unwrap();
        let program_of = |program: &str| command_in(dir.path(), Path::new(program)).unwrap().get_program().to_owned();
        let here = std::env::current_dir().unwrap();
        assert_eq!(program_of("env/bin/python"), here.join("env/bin/python"));
        assert_eq!(program_of("./python"), here.join("python"));
        assert_eq!(program_of("python3"), "python3");
        let link = dir.path().join("link");
        assert_eq!(program_of(link.to_str().unwrap()), link);
        let output = command_in(dir.path(), Path::new("pwd")).unwrap().output().unwrap();
        let folder = String::from_utf8(output.stdout).unwrap();
        assert_eq!(Path::new(folder.trim()), dir.path());
    }
}
