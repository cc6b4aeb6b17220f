//! Programs of others that this one starts: in another folder than the user's, so that nothing that lies in the working
//! directory is run, loaded or read as configuration.

use anyhow::{Context, Result};
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

/// A folder for a program that needs no files of its own; removed when this is dropped. Errors: the folder of temporary files
/// cannot be written.
pub fn empty_folder() -> Result<TempDir> {
    let place = std::env::temp_dir();
    tempfile::tempdir().with_context(|| format!("cannot make an empty folder in {} (TMPDIR)", place.display()))
}

/// A command that runs `program` in `folder`. A bare name is searched for in PATH by the child after its change of folder,
/// so that a relative entry of PATH does not lead into the working directory. A path counts from the working directory;
/// symbolic links in it stay, because the Python of a virtual environment finds its packages by the link. Errors: the
/// working directory of a relative path is gone.
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
    fn a_path_counts_from_the_working_directory_and_its_links_stay() {
        let dir = tempfile::tempdir().unwrap();
        symlink("/bin/sh", dir.path().join("link")).unwrap();
        let below = |program: &str| command_in(dir.path(), Path::new(program)).unwrap().get_program().to_owned();
        let here = std::env::current_dir().unwrap();
        assert_eq!(below("env/bin/python"), here.join("env/bin/python"));
        assert_eq!(below("./python"), here.join("python"));
        assert_eq!(below("python3"), "python3");
        let link = dir.path().join("link");
        assert_eq!(below(link.to_str().unwrap()), link);
        let output = command_in(dir.path(), Path::new("pwd")).unwrap().output().unwrap();
        let folder = String::from_utf8(output.stdout).unwrap();
        assert_eq!(Path::new(folder.trim()), dir.path());
    }
}
