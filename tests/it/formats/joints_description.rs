//! Descriptions of joints.

use orator_base::types::time::FrameRate;
use orator_formats::joints_description::{is_description, path_of, rate, with};
use std::path::Path;

#[test]
fn rate_round_trips_and_other_frame_count_is_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    let text = |description: &str| std::fs::write(path_of(&path), description).unwrap();
    let assert_error = |words: &str| {
        let error = format!("{:#}", rate(&path, 4).unwrap_err());
        assert!(error.contains("a.npy.json") && error.contains(words), "{error}");
    };
    assert_eq!(rate(&path, 4).unwrap(), None);
    let ntsc = FrameRate::new(30_000, 1001);
    with(&path, ntsc, &[4, 49, 3], |attempt| Ok(std::fs::write(attempt, "numbers")?)).unwrap();
    assert_eq!(rate(&path, 4).unwrap(), Some(ntsc));
    assert!(is_description(&path_of(&path)) && !is_description(&path) && !is_description(Path::new("a.json")));
    assert!(format!("{:#}", rate(&path, 5).unwrap_err()).contains("describes 4 frames"));
    text("{\"fps\": 29.97}");
    assert_eq!(rate(&path, 9).unwrap(), Some(ntsc));
    text("{\"fps\": [30, 0]}");
    assert_error("1 to 1000");
    text("{\"fps\": 0.5}");
    assert_error("1 to 1000");
    text("{\"rate\": 30}");
    assert_error("has no frame rate");
    text("no JSON");
    assert_error("delete it");
}
