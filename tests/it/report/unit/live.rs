//! Unit tests of `orator_report::training::live`.

use orator_report::training::live::{PAGE, write};
use serde_json::json;

#[test]
fn metrics_of_training_data_are_not_called_held_out() {
    let dir = tempfile::tempdir().unwrap();
    let page = |split: &str| {
        let validation = json!({ "split": split, "n_windows": 2, "score": 1.0 });
        let line = json!({ "step": 9, "validation": validation });
        std::fs::write(dir.path().join("metrics.jsonl"), format!("{line}\n")).unwrap();
        write(dir.path(), "anna", &[]).unwrap();
        std::fs::read_to_string(dir.path().join(PAGE)).unwrap()
    };
    assert!(!page("validation").contains("Without validation data"));
    let page = page("train");
    assert!(page.contains("Without validation data") && page.contains("of the training split"), "{page}");
}
