//! Unit tests of `orator_formats::sound_offset_json`.

use orator_base::types::sound::SoundOffset;
use orator_formats::sound_offset_json::read;

#[test]
fn missing_and_damaged_offsets_are_distinguished() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("offset.json");
    assert_eq!(read(&path).unwrap(), None);
    let offset = SoundOffset { secs: 0.1, correlation: 0.4, confidence: 1.0, compared_secs: 9.0 };
    std::fs::write(&path, serde_json::to_vec(&offset).unwrap()).unwrap();
    assert_eq!(read(&path).unwrap(), Some(offset));
    for text in ["{", r#"{"secs":1e9,"correlation":0,"confidence":1,"compared_secs":1}"#] {
        std::fs::write(&path, text).unwrap();
        assert!(read(&path).is_err());
    }
}
