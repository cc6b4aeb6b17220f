//! Unit tests of `orator_base::foreign_program`.

use orator_base::foreign_program::command_in;
use std::os::unix::fs::symlink;
use std::path::Path;

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
