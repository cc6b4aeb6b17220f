//! Tests of `orator_formats::tfevents`.

use orator_formats::tfevents::{collect, record};
use serde_json::json;

#[test]
fn tags_are_paths_in_the_log_line() {
    let mut found = Vec::new();
    let line =
        json!({"generator": {"pck": 0.5, "frechet": null}, "mean_pose": {"pck": 0.25}, "split": "test", "score": 2});
    collect("validation", line.as_object().unwrap(), &mut found);
    let expected = [("validation/pck", 0.5), ("validation/mean_pose/pck", 0.25), ("validation/score", 2.0)];
    assert_eq!(found, expected.map(|(name, value)| (name.to_owned(), value)));
    assert!(record(&json!({"step": 3})).is_none() && record(&json!({"l1": 3})).is_none());
}
