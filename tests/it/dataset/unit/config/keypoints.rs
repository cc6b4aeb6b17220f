//! Tests of `orator_dataset::config::keypoints`.

use orator_base::types::time::FrameRate;
use orator_dataset::config::SpeakerConfig;
use orator_dataset::config::keypoints::{of_speaker, video_name};
use orator_dataset::config::patterns::SearchRoot;
use std::path::PathBuf;

fn speaker(keypoints: &[&str], audio: &[&str]) -> SpeakerConfig {
    let list = |entries: &[&str]| entries.iter().map(|entry| (*entry).to_owned()).collect();
    SpeakerConfig { keypoints: list(keypoints), audio: list(audio), fps: 29.97, ..SpeakerConfig::default() }
}

#[test]
fn folders_of_frames_and_files_are_matched_to_audio_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = dir.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    for frame in 0..3 {
        write(&format!("op/talk/talk_{frame:012}_keypoints.json"), "{\"version\":1.3,\"people\":[]}");
    }
    write("op/notes.txt", "");
    write("mm/results_b.json", "{\"meta_info\": {}, \"instance_info\": []}");
    write("mm/c.json", "[{\"image_id\": \"0.jpg\"}]");
    write("sound/TALK.wav", "");
    write("sound/b.m4a", "");
    for entries in [&["op", "mm"][..], &["op/talk", "mm/*"], &["op/*/*.json", "mm/*.json"]] {
        let mut missing = Vec::new();
        let found = of_speaker(&speaker(entries, &["sound"]), &SearchRoot::new(dir.path(), &[]), &mut missing);
        let found: Vec<(String, Result<PathBuf, String>)> =
            found.into_iter().map(|(path, source)| (video_name(&path), source.sound)).collect();
        assert_eq!(missing, Vec::<String>::new());
        let sound = |name: &str| Ok(dir.path().join("sound").join(name));
        let none = Err("no file named c is listed in `audio`: name it after the keypoint file, as in c.wav".to_owned());
        let expected = [("c", none), ("b", sound("b.m4a")), ("talk", sound("TALK.wav"))];
        assert_eq!(found, expected.map(|(name, sound)| (name.to_owned(), sound)), "{entries:?}");
    }
    let mut missing = Vec::new();
    let found =
        of_speaker(&speaker(&["mm/c.json", "none/*.npz"], &[]), &SearchRoot::new(dir.path(), &[]), &mut missing);
    let source = &found[&dir.path().join("mm/c.json")];
    assert_eq!((source.fps, source.image_size), (Some(FrameRate::new(30_000, 1001)), None));
    assert!(source.sound.as_ref().unwrap_err().contains("add `audio = "));
    assert!(missing.len() == 1 && missing[0].contains("none/*.npz: no matching file"), "{missing:?}");
    // A single keypoint file and a single sound are matched regardless of their names.
    let found = of_speaker(&speaker(&["mm/c.json"], &["sound/b.m4a"]), &SearchRoot::new(dir.path(), &[]), &mut missing);
    assert!(found.values().all(|source| source.sound.is_ok()));
}
