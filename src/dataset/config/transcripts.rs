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
