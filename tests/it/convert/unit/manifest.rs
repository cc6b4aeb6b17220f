//! Tests of `orator_onnx::manifest`.

use orator_onnx::ModelRole;
use orator_onnx::manifest::{MANIFEST_FILE, Manifest};

const BUILTIN: &str = include_str!("../../../../models/manifest.toml");

#[test]
fn builtin_manifest_round_trips() {
    let manifest = Manifest::builtin().unwrap();
    assert_eq!((manifest.models.len(), manifest.layouts.len()), (18, 5));
    assert_eq!(Manifest::parse(&toml::to_string(&manifest).unwrap()).unwrap(), manifest);
    for entry in &manifest.models {
        assert!(entry.is_served() != entry.conversion.is_some(), "{}: a source or a conversion", entry.id);
    }
}

#[test]
fn errors_name_the_invalid_entry() {
    let message = |from: &str, to: &str| format!("{:#}", Manifest::parse(&BUILTIN.replacen(from, to, 1)).unwrap_err());
    assert!(message("role = \"person\"", "rolle = \"person\"").contains("rolle"));
    assert!(message("min_score = 0.3", "min_scores = 0.3").contains("min_score"));
    assert!(message("boxes = \"dets\"", "boxes = \"det\"").contains("output \"det\""));
    assert!(message("sha256 = \"4720", "sha256 = \"x720").contains("64 hex"));
    assert!(message("[1, 3, 320, 320]", "[1, 320, 320]").contains("shape"));
    assert!(message("body = [0, ", "body = [99, ").contains("index 99"));
    assert!(message("file = \"wink", "file = \"../wink").contains("plain file name"));
    assert!(message("margin = 1.25", "margin = 0.0").contains("incompatible"));
    assert!(message("person-yolox-nano", "person-rtmdet-nano").contains("duplicate"));
}

#[test]
fn manifest_of_the_folder_overrides_the_builtin_one() {
    let dir = tempfile::tempdir().unwrap();
    let mut own = Manifest::builtin().unwrap().get("person-rtmdet-nano").unwrap().clone();
    own.id = "person-mine".into();
    let text = toml::to_string(&Manifest { models: vec![own.clone()], ..Manifest::default() }).unwrap();
    std::fs::write(dir.path().join(MANIFEST_FILE), text).unwrap();
    let manifest = Manifest::load(dir.path()).unwrap();
    assert_eq!((manifest.models.len(), manifest.get("person-mine").unwrap()), (19, &own));
    assert!(manifest.get("nobody").unwrap_err().to_string().contains("expected one of"));
    assert!(manifest.get_as("person-mine", ModelRole::Hand).is_err());
}
