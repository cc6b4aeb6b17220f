//! Unit tests of `orator_base::stage::workdir::lock`.

use orator_base::stage::workdir::{BusyFolder, FolderLock, lock, locks_work, remove};
use std::fs;

#[test]
fn readers_share_a_lock_and_the_error_of_a_writer_names_them() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("host");
    let (first, second) = (FolderLock::shared(&folder).unwrap(), FolderLock::shared(&folder).unwrap());
    let error = FolderLock::exclusive(&folder).unwrap_err();
    let expected = format!("(process {}); wait", std::process::id());
    assert!(error.is::<BusyFolder>() && error.to_string().contains(&expected), "{error}");
    drop(first);
    assert!(FolderLock::exclusive(&folder).is_err());
    drop(second);
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0, "the file goes with the last");
    let writer = FolderLock::exclusive(&folder).unwrap();
    assert!(FolderLock::shared(&folder).is_err());
    drop(writer);
    assert!(locks_work(dir.path()).unwrap());
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[test]
fn lock_files_are_never_links_and_never_truncated() {
    let dir = tempfile::tempdir().unwrap();
    let (work, victim) = (dir.path().join("work"), dir.path().join("victim"));
    fs::write(&victim, "precious").unwrap();
    fs::create_dir(&work).unwrap();
    for path in [work.join(".lock"), dir.path().join(".work.lock")] {
        std::os::unix::fs::symlink(&victim, &path).unwrap();
    }
    for error in [lock(&work).unwrap_err(), FolderLock::shared(&work).unwrap_err()] {
        assert!(error.to_string().contains("is a link"), "{error:#}");
    }
    assert_eq!(fs::read_to_string(&victim).unwrap(), "precious");
    for is_folder in [true, false] {
        remove(&work.join(".lock")).unwrap();
        if is_folder {
            fs::create_dir(work.join(".lock")).unwrap();
        } else {
            assert!(std::process::Command::new("mkfifo").arg(work.join(".lock")).status().unwrap().success());
        }
        let error = lock(&work).unwrap_err().to_string();
        assert!(error.contains("is a folder or a pipe") && error.contains("remove it"), "{error}");
    }
    fs::remove_file(work.join(".lock")).unwrap();
    let first = lock(&work).unwrap();
    let text = fs::read_to_string(work.join(".lock")).unwrap();
    assert!(lock(&work).is_err());
    assert_eq!(fs::read_to_string(work.join(".lock")).unwrap(), text, "who is refused changes nothing");
    drop(first);
    assert!(lock(&work).is_ok());
}

#[test]
fn shared_lock_restores_a_folder_that_was_being_replaced() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("host");
    fs::create_dir(dir.path().join(".host.old")).unwrap();
    let _lock = FolderLock::shared(&folder).unwrap();
    assert!(folder.is_dir());
}
