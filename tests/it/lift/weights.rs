//! Weights of observed points.

use orator_pipeline::lift::weights::{BODY, HANDS, body, hands};
use std::path::Path;

#[test]
fn the_built_in_weights_fit_and_are_small() {
    body(Path::new("")).unwrap();
    hands(Path::new("")).unwrap();
    assert!(BODY.len() + HANDS.len() <= 6_000_000);
}

#[test]
fn an_invalid_file_is_reported_with_the_reason() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("w.safetensors");
    std::fs::write(&path, HANDS).unwrap();
    hands(&path).unwrap();
    let error_of = |path: &Path| format!("{:#}", body(path).err().unwrap());
    assert!(
        error_of(&path).contains("hand-lifter") && error_of(&path).contains("w.safetensors"),
        "{}",
        error_of(&path)
    );
    std::fs::write(&path, &HANDS[..HANDS.len() / 2]).unwrap();
    assert!(error_of(&path).contains("w.safetensors"));
    std::fs::write(&path, b"text").unwrap();
    assert!(error_of(&path).contains("w.safetensors"));
    assert!(error_of(&dir.path().join("none")).contains("cannot read"));
}
