//! Matching of a speaker's `transcripts` to videos by file name: the name of the video, optionally followed by a dot
//! and more (`talk.srt`, `talk.en.vtt`). With `"auto"` there are none to match: the stage `transcribe` writes them.

use super::SpeakerConfig;
use super::patterns::{self, SearchRoot, TRANSCRIPT_EXTENSIONS};
use orator_base::stage::Unit;
use orator_base::text::composed;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Files that may be the transcript of the speaker's videos, sorted, by the work name of the video. Messages about
/// entries without files and transcripts without a video are added to `missing`.
pub fn of_speaker(
    speaker: &SpeakerConfig,
    units: &[Unit],
    root: &SearchRoot,
    missing: &mut Vec<String>,
) -> BTreeMap<String, Vec<PathBuf>> {
    let mut paths = BTreeSet::new();
    for entry in speaker.transcripts.iter().filter(|_| !speaker.transcribes()) {
        match patterns::expand(entry, root, ("transcript", &TRANSCRIPT_EXTENSIONS), missing) {
            Ok(found) => paths.extend(found),
            Err(message) => missing.push(format!("transcripts: {message}")),
        }
    }
    let mut found: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for path in &paths {
        let named = || {
            units
                .iter()
                .filter(|unit| is_transcript_of(path, &unit.source))
                .max_by_key(|unit| unit.source.as_os_str().len())
        };
        let unit = if paths.len() == 1 && units.len() == 1 { units.first() } else { named() };
        let file = path.display();
        match unit {
            _ if !path.is_file() => missing.push(format!("transcripts: {file} is not a file")),
            None => missing.push(format!("transcripts: {file} matches no video: name it after its video")),
            Some(unit) => found.entry(unit.video.clone()).or_default().push(path.clone()),
        }
    }
    found
}

/// Whether the name of a transcript matches that of a video or its keypoints, ignoring case and the form of accents.
fn is_transcript_of(transcript: &Path, video: &Path) -> bool {
    let folded = |name: Option<&OsStr>| composed(&name.unwrap_or_default().to_string_lossy()).to_lowercase();
    let video = folded(if video.is_dir() { video.file_name() } else { video.file_stem() });
    let name = folded(transcript.file_stem());
    name == video || name.strip_prefix(&video).is_some_and(|more| more.starts_with('.'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transcripts_are_matched_to_videos_by_name() {
        let dir = tempfile::tempdir().unwrap();
        let files =
            ["a.mp4", "a.b.mp4", "c.mp4", "t/A.en.srt", "t/a.b.json", "t/c.vtt", "t/c.txt", "t/d.srt", "t/x.pdf"];
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
}
