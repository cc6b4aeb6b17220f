//! Tests of `orator_onnx::runtime`.

use orator_onnx::runtime::{LIBRARY, find_library, library_in};

#[test]
fn library_is_found_in_lib_and_its_absence_is_explained() {
    let dir = tempfile::tempdir().unwrap();
    let error = find_library(&dir.path().join("gone.so"), dir.path()).unwrap_err();
    assert!(error.to_string().contains("gone.so") && error.to_string().contains("make runtime"));
    std::fs::create_dir(dir.path().join("lib")).unwrap();
    for version in ["1.9.0", "1.31.1"] {
        std::fs::write(dir.path().join(format!("lib/{LIBRARY}.{version}")), b"").unwrap();
    }
    assert!(library_in(&dir.path().join("lib")).is_some());
    assert!(library_in(&dir.path().join("nothing")).is_none());
}
