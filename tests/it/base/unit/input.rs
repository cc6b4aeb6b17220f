//! Unit tests of `orator_base::input`.

use orator_base::input::{MAX_TEXT, read, read_text};
use std::io::ErrorKind;

#[test]
fn only_regular_files_of_a_bounded_size_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    std::fs::write(at("a.txt"), "words").unwrap();
    std::os::unix::fs::symlink("a.txt", at("link.txt")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", at("zero")).unwrap();
    let pipe = std::process::Command::new("mkfifo").arg(at("pipe")).status().unwrap();
    let _socket = std::os::unix::net::UnixListener::bind(at("socket")).unwrap();
    assert_eq!(read(at("a.txt"), 5).unwrap(), b"words");
    assert_eq!(read_text(at("link.txt"), MAX_TEXT).unwrap(), "words");
    let error_of = |name: &str| read(at(name), 4).unwrap_err().to_string();
    assert_eq!(error_of("a.txt"), "it exceeds the limit of 4 bytes");
    assert!(pipe.success());
    assert_eq!(error_of("pipe"), "it is a named pipe, expected a regular file");
    assert_eq!(error_of("zero"), "it is a device, expected a regular file");
    assert_eq!(error_of("socket"), "it is a socket, expected a regular file");
    assert_eq!(error_of(""), "it is a folder, expected a regular file");
    assert_eq!(read(at("none"), 4).unwrap_err().kind(), ErrorKind::NotFound);
    std::fs::write(at("latin"), b"so\xf6").unwrap();
    assert!(read_text(at("latin"), 9).unwrap_err().to_string().contains("not UTF-8"));
}
