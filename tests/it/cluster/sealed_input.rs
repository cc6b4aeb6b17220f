//! Inputs whose contents are sealed by a hash.

use orator_base::stage::Input;
use orator_base::stage::fingerprint::HashCache;
use orator_cluster::sealed_input::SealedInput;
use std::fs::{self, File};
use std::time::{Duration, SystemTime};

#[test]
fn a_changed_video_is_reported_and_a_touched_one_accepted() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.mp4");
    let hashes = HashCache::open(&dir.path().join("hashes.json"));
    let write = |text: &str, secs_ago: u64| {
        fs::write(&path, text).unwrap();
        File::open(&path).unwrap().set_modified(SystemTime::now() - Duration::from_secs(secs_ago)).unwrap();
    };
    write("planned", 100);
    let sealed = SealedInput::new(Input { role: "video".into(), path: path.clone() }, &hashes).unwrap();
    let json = serde_json::to_string(&sealed).unwrap();
    assert_eq!(serde_json::from_str::<SealedInput>(&json).unwrap(), sealed);
    let check = || sealed.check(&hashes).map_err(|error| format!("{error:#}"));
    assert_eq!(check(), Ok(()));
    write("planned", 50);
    assert_eq!(check(), Ok(()), "a time alone is no change");
    for (text, secs_ago) in [("changed", 40), ("longer than planned", 100)] {
        write(text, secs_ago);
        let error = check().unwrap_err();
        assert!(error.contains("a.mp4 changed since the plan") && error.contains("orator plan"), "{error}");
    }
    write("planned", 10);
    assert_eq!(check(), Ok(()));
    fs::remove_file(&path).unwrap();
    assert!(check().unwrap_err().contains("a.mp4"));
}
