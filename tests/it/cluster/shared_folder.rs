//! Files in a folder that several machines share.

use orator_cluster::shared_folder::{DiskFolder, SharedFolder};
use std::fs;

#[test]
fn one_of_several_concurrent_creations_succeeds() {
    let dir = tempfile::tempdir().unwrap();
    let folder = DiskFolder(dir.path().to_owned());
    let created: usize = std::thread::scope(|scope| {
        let tries: Vec<_> = (0..8)
            .map(|worker| {
                let folder = &folder;
                scope.spawn(move || {
                    let created =
                        |unit: i32| folder.create(&format!("a/{unit}"), format!("worker {worker}").as_bytes());
                    (0..50).filter(|unit| created(*unit).unwrap()).count()
                })
            })
            .collect();
        tries.into_iter().map(|one| one.join().unwrap()).sum()
    });
    assert_eq!(created, 50);
    assert_eq!(folder.list("a").unwrap().len(), 50);
    assert_eq!(fs::read_dir(dir.path().join("a")).unwrap().count(), 50, "no draft is left");
    assert_eq!(folder.list("b").unwrap(), Vec::<String>::new());
    assert_eq!(folder.read("b/c").unwrap(), None);
}

#[test]
fn other_file_kinds_occupy_their_name_without_blocking() {
    let dir = tempfile::tempdir().unwrap();
    let folder = DiskFolder(dir.path().to_owned());
    let at = |name: &str| dir.path().join("a").join(name);
    fs::create_dir_all(at("folder")).unwrap();
    std::os::unix::fs::symlink("nowhere", at("link")).unwrap();
    std::os::unix::fs::symlink("circle", at("circle")).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(at("pipe")).status().unwrap().success());
    for name in ["a/folder", "a/link", "a/circle", "a/pipe"] {
        assert!(!folder.create(name, b"mine").unwrap(), "{name}");
        assert_eq!(folder.read(name).unwrap().as_deref(), Some(&b""[..]), "{name}");
    }
    let mut names = folder.list("a").unwrap();
    names.sort();
    assert_eq!(names, ["circle/", "folder/", "link/", "pipe/"]);
}
