//! Unit tests of `orator_dataset::config::transcripts`.

use orator_base::stage::Unit;
use orator_dataset::config::SpeakerConfig;
use orator_dataset::config::patterns::SearchRoot;
use orator_dataset::config::transcripts::of_speaker;
use std::path::PathBuf;

#[test]
fn transcripts_are_matched_to_videos_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let files = ["a.mp4", "a.b.mp4", "c.mp4", "t/A.en.srt", "t/a.b.json", "t/c.vtt", "t/c.txt", "t/d.srt", "t/x.pdf"];
    for file in files {
        let path = dir.path().join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, "").unwrap();
    }
    let unit = |file: &str| Unit { speaker: "host".into(), video: file.into(), source: dir.path().join(file) };
    let units = ["a.mp4", "a.b.mp4", "c.mp4"].map(unit);
    let find = |entries: &[&str], units: &[Unit]| {
        let transcripts = entries.iter().map(|entry| (*entry).to_owned()).collect();
        let speaker = SpeakerConfig { transcripts, ..SpeakerConfig::default() };
        let mut missing = Vec::new();
        let found = of_speaker(&speaker, units, &SearchRoot::new(dir.path(), &[]), &mut missing);
        let names = |paths: Vec<PathBuf>| {
            paths.iter().map(|path| path.file_name().unwrap().to_string_lossy()).collect::<Vec<_>>().join(" ")
        };
        (found.into_iter().map(|(video, paths)| format!("{video} {}", names(paths))).collect::<Vec<_>>(), missing)
    };
    let (found, missing) = find(&["t"], &units);
    assert_eq!(found, ["a.b.mp4 a.b.json", "a.mp4 A.en.srt", "c.mp4 c.txt c.vtt"]);
    assert!(missing[0].contains("d.srt") && missing.len() == 1, "{missing:?}");
    // Accents may be composed or not, and endings have any case.
    for (file, video) in [("u/Vortra\u{308}ge.de.SRT", "Vortr\u{e4}ge.MP4"), ("u/x.VTT", "x.mov")] {
        std::fs::create_dir_all(dir.path().join("u")).unwrap();
        std::fs::write(dir.path().join(file), "").unwrap();
        let name = file.strip_prefix("u/").unwrap();
        assert!(find(&["u"], &[unit(video), unit("z.mp4")]).0.contains(&format!("{video} {name}")), "{file}");
    }
    // A single transcript and a single video are matched regardless of their names.
    assert_eq!(find(&["t/d.srt"], &units[..1]).0, ["a.mp4 d.srt"]);
    let (found, missing) = find(&["gone.srt", "t/*.ctm"], &units);
    assert!(found.is_empty() && missing.len() == 2, "{missing:?}");
    assert!(missing.iter().any(|message| message.contains("gone.srt is not a file")), "{missing:?}");
}
