//! Tests of `orator_dataset::config::videos`.

use orator_base::types::split::Split;
use orator_dataset::config::SpeakerConfig;
use orator_dataset::config::patterns::SearchRoot;
use orator_dataset::config::videos::{of_speaker, slug, work_name};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn root(folder: &Path) -> SearchRoot {
    SearchRoot::new(folder, &[])
}

#[test]
fn equal_names_in_two_folders_get_distinct_names_without_dots() {
    let folder = Path::new("/data");
    let a = work_name(Path::new("/data/a/My Talk.v2.mp4"), folder);
    let b = work_name(Path::new("/data/b/My Talk.v2.mp4"), folder);
    assert!(a.starts_with("my-talk-v2-") && a.len() == "my-talk-v2-".len() + 8 && a != b);
    assert_eq!(slug("Ünï"), "n");
    assert_eq!(slug("..."), "video");
}

#[test]
fn patterns_folders_and_missing_files_are_resolved() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["b.mp4", "a.MKV", "notes.txt"] {
        std::fs::write(dir.path().join(name), "").unwrap();
    }
    std::fs::create_dir(dir.path().join("empty")).unwrap();
    let videos = ["*.mp4", ".", "empty", "none-*.mp4", "gone.mp4"].map(str::to_owned).to_vec();
    let videos =
        of_speaker(&SpeakerConfig { name: "host".into(), videos, ..SpeakerConfig::default() }, &root(dir.path()));
    let names: Vec<&str> = videos.units.iter().map(|unit| unit.video.split('-').next().unwrap()).collect();
    assert_eq!(names, ["a", "b", "gone"]);
    assert_eq!((videos.missing.len(), videos.passed_over), (2, vec!["notes.txt".to_owned()]));
}

#[test]
fn the_folder_of_the_configuration_is_not_a_pattern() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("talks [2024] *");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(folder.join("a.mp4"), "").unwrap();
    let videos = of_speaker(&host(&["*.mp4"]), &root(&folder));
    assert_eq!((videos.units.len(), videos.missing.len()), (1, 0));
}

fn host(videos: &[&str]) -> SpeakerConfig {
    SpeakerConfig {
        name: "host".into(),
        videos: videos.iter().map(|v| (*v).to_owned()).collect(),
        ..SpeakerConfig::default()
    }
}

#[test]
fn videos_are_excluded_and_assigned_to_splits_by_name() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["a.mp4", "b [1].mp4", "c.mp4", "d.mp4"] {
        std::fs::write(dir.path().join(name), "").unwrap();
    }
    let list = |entries: &[&str]| entries.iter().map(|e| (*e).to_owned()).collect::<Vec<_>>();
    assert!(orator_dataset::config::videos::names("e\u{301}*.MP4", &dir.path().join("\u{e9}t\u{e9}.mp4"), dir.path()));
    let mut speaker = SpeakerConfig { exclude: list(&["c.*", "gone.mp4"]), ..host(&["*.mp4"]) };
    (speaker.test, speaker.train) = (list(&["b [1].mp4"]), list(&[&dir.path().join("a.mp4").to_string_lossy()]));
    let videos = of_speaker(&speaker, &root(dir.path()));
    let split = |name: &str| videos.splits.iter().find(|(video, _)| video.starts_with(name)).map(|(_, s)| *s);
    assert_eq!((videos.units.len(), videos.missing.len()), (3, 0));
    assert_eq!((split("a-"), split("b-1-"), split("d-")), (Some(Split::Train), Some(Split::Test), None));
    (speaker.validation, speaker.test) = (list(&["a.mp4", "none.mp4"]), list(&[]));
    let missing = of_speaker(&speaker, &root(dir.path())).missing;
    assert!(missing[0].contains("in train and in validation") && missing[1].contains("none.mp4"), "{missing:?}");
}

#[test]
fn equal_work_names_are_reported() {
    // Names whose slug is empty, tried until two have the same eight hash digits.
    let mut known = BTreeMap::new();
    let stem = |n: u32| (0..20).map(|bit| if n >> bit & 1 == 0 { 'é' } else { 'è' }).collect::<String>();
    let collides = |n: u32| {
        let file = format!("{}.mp4", stem(n));
        Some((known.insert(work_name(Path::new(&file), Path::new("")), file.clone())?, file))
    };
    let (first, second) = (0..1 << 20).find_map(collides).unwrap();
    let dir = tempfile::tempdir().unwrap();
    for file in [&first, &second] {
        std::fs::write(dir.path().join(file), "").unwrap();
    }
    for entries in [&[&*first, &*second][..], &["*.mp4"]] {
        let videos = of_speaker(&host(entries), &root(dir.path()));
        assert_eq!((videos.units.len(), videos.missing.len()), (1, 1), "{:?}", videos.missing);
        assert!(videos.missing[0].contains("would both be named video-"), "{:?}", videos.missing);
    }
    assert_eq!(of_speaker(&host(&[&first, &first]), &root(dir.path())).missing, [""; 0]);
}

#[test]
fn a_file_name_that_is_not_utf8_is_an_error() {
    use std::os::unix::ffi::OsStrExt as _;
    let dir = tempfile::tempdir().unwrap();
    for name in [&b"a.mp4"[..], b"b\xfe.mp4", b"b\xff.mp4", b"b\xff.txt"] {
        std::fs::write(dir.path().join(std::ffi::OsStr::from_bytes(name)), "").unwrap();
    }
    for entry in [".", "*.mp4"] {
        let videos = of_speaker(&host(&[entry]), &root(dir.path()));
        assert_eq!((videos.units.len(), videos.missing.len()), (1, 2), "{:?}", videos.missing);
        assert!(videos.missing.iter().all(|missing| missing.contains("not valid UTF-8")), "{:?}", videos.missing);
    }
}

#[test]
fn a_pattern_skips_files_that_the_program_wrote() {
    let dir = tempfile::tempdir().unwrap();
    for file in ["a.mp4", "talks/b.mp4", "work/extract/host/a-1/audio.wav", "work/report.html", "models/m.onnx"] {
        let path = dir.path().join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, "").unwrap();
    }
    let own = ["work", "models"].map(|name| dir.path().join(name));
    let own: Vec<&Path> = own.iter().map(PathBuf::as_path).collect();
    let files = |entry: &str, own: &[&Path]| {
        let videos = of_speaker(&host(&[entry]), &SearchRoot::new(dir.path(), own)).units;
        let mut files: Vec<PathBuf> = videos.into_iter().map(|unit| unit.source).filter(|p| p.is_file()).collect();
        files.sort();
        files.iter().map(|path| path.strip_prefix(dir.path()).unwrap().to_owned()).collect::<Vec<_>>()
    };
    let expected = ["a.mp4", "talks/b.mp4"].map(PathBuf::from);
    assert_eq!(files("**/*", &own), expected);
    assert_eq!(files("**/*", &[dir.path()]).len(), 5, "videos inside the work folder itself");
    // A file named explicitly is not skipped.
    assert_eq!(files("work/report.html", &own).len(), 1);
}
