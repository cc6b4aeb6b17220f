//! Unit tests of `orator_formats::timeline_npz`.

use ndarray::aview1;
use orator_formats::timeline_npz::Timeline;

#[test]
fn timeline_round_trips_and_missing_arrays_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.npz");
    let timeline = Timeline {
        source_secs: vec![0.0, 0.1],
        repeated: vec![false, true],
        shot_score: vec![0.0, 0.75],
        restart: vec![false, true],
        span: vec![false, true],
        frame_difference: vec![0.0, 2.5],
    };
    timeline.write(&path).unwrap();
    assert_eq!(Timeline::read(&path).unwrap(), timeline);
    orator_formats::npz::write(&path, |npz| npz.add_array("repeated", &aview1(&[false; 3]))).unwrap();
    let text = format!("{:#}", Timeline::read(&path).unwrap_err());
    assert!(text.contains("a.npz") && text.contains("source_secs"), "{text}");
}
