//! Resolution of a speaker's `keypoints` entries to files and folders, one per video, with their frame rate, image size
//! and sound. A folder of per-frame files (OpenPose) is one video; other folders contain a file or folder per video.

use super::SpeakerConfig;
use super::patterns::{self, SOUND_EXTENSIONS, SearchRoot, VIDEO_EXTENSIONS};
use orator_base::input;
use orator_base::text::composed;
use orator_base::types::time::FrameRate;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Read as _;
use std::path::{Path, PathBuf};

const EXTENSIONS: [&str; 3] = ["json", "npz", "npy"];
/// Number of bytes at the start of a JSON file that are inspected to detect whether it contains a single frame.
const HEAD_BYTES: u64 = 4096;
/// Keys that occur only in JSON files with many frames.
const MULTI_FRAME_KEYS: [&str; 6] =
    ["\"instance_info\"", "\"meta_info\"", "\"frame_id\"", "\"image_id\"", "\"annotations\"", "\"images\""];
/// Prefixes and suffixes that pose estimators add to the name of the video.
const PREFIXES: [&str; 2] = ["results_", "alphapose-"];
const SUFFIXES: [&str; 5] = ["_keypoints", "-keypoints", "_openpose", "_pose", "_landmarks"];

/// Settings of the keypoints of a video.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeypointSource {
    /// Frame rate; `None`: the keypoint file must state it.
    pub fps: Option<FrameRate>,
    /// Width and height of the image, px; `None`: the keypoint file must state them.
    pub image_size: Option<[u32; 2]>,
    /// Path of the sound, or the reason why there is none.
    pub sound: Result<PathBuf, String>,
}

/// All keypoint files and folders of a speaker; messages about entries without keypoints are added to `missing`.
pub fn of_speaker(
    speaker: &SpeakerConfig,
    root: &SearchRoot,
    missing: &mut Vec<String>,
) -> BTreeMap<PathBuf, KeypointSource> {
    let mut paths = BTreeSet::new();
    for entry in &speaker.keypoints {
        match expand_entry(entry, root, missing) {
            Ok(found) => paths.extend(found),
            Err(message) => missing.push(message),
        }
    }
    let endings = [&SOUND_EXTENSIONS[..], &VIDEO_EXTENSIONS].concat();
    let mut sounds = BTreeSet::new();
    for entry in &speaker.audio {
        match patterns::expand(entry, root, ("sound", &endings), missing) {
            Ok(found) => sounds.extend(found),
            Err(message) => missing.push(format!("audio: {message}")),
        }
    }
    let is_one = paths.len() == 1 && sounds.len() == 1;
    let source = |path: PathBuf| {
        let name = video_name(&path);
        let sound = sounds.iter().find(|sound| is_one || video_name(sound) == name).cloned();
        let sound = sound.ok_or_else(|| if speaker.audio.is_empty() {
                "keypoint files contain no audio: add `audio = [\"FOLDER\"]` beside `keypoints` (a folder, a pattern or a \
                     file; a sound is found by the name of its keypoints)"
                    .to_owned()
            } else { format!("no file named {name} is listed in `audio`: name it after the keypoint file, as in {name}.wav") });
        let fps = FrameRate::nearest(speaker.fps).filter(|_| speaker.fps > 0.0);
        (path, KeypointSource { fps, image_size: speaker.image_size(), sound })
    };
    paths.into_iter().map(source).collect()
}

fn expand_entry(entry: &str, root: &SearchRoot, missing: &mut Vec<String>) -> Result<Vec<PathBuf>, String> {
    let mut found = Vec::new();
    let mut frames_in: BTreeMap<PathBuf, bool> = BTreeMap::new();
    for path in patterns::matches(entry, root, missing)? {
        if path.is_dir() {
            found.extend(expand_folder(&path).map_err(|error| format!("{entry}: cannot list the folder: {error}"))?);
            continue;
        }
        // If a pattern matches the per-frame files of a folder, the folder is the video.
        let parent = path.parent().unwrap_or(&root.folder).to_owned();
        let has_frames = || is_json(&path) && entry.contains(['*', '?', '[']) && is_frame(&path);
        if *frames_in.entry(parent.clone()).or_insert_with(has_frames) { found.push(parent) } else { found.push(path) }
    }
    let nothing = || {
        format!(
            "{entry}: no keypoint files found: expected {}, or folders with a file per frame",
            EXTENSIONS.join(", ")
        )
    };
    if found.is_empty() { Err(nothing()) } else { Ok(found) }
}

/// The folder itself if it contains per-frame files, otherwise the keypoint files and folders of frames in it.
fn expand_folder(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let paths = patterns::list(folder)?;
    if contains_frames(&paths) {
        return Ok(vec![folder.to_owned()]);
    }
    let is_one = |path: &PathBuf| {
        if path.is_dir() {
            patterns::list(path).is_ok_and(|paths| contains_frames(&paths))
        } else {
            patterns::has_extension(path, &EXTENSIONS)
        }
    };
    Ok(paths.into_iter().filter(is_one).collect())
}

fn contains_frames(paths: &[PathBuf]) -> bool {
    paths.iter().find(|path| is_json(path)).is_some_and(|path| is_frame(path))
}

fn is_json(path: &Path) -> bool {
    patterns::has_extension(path, &EXTENSIONS[..1])
}

/// Whether a JSON file contains a single frame; false if it cannot be read.
fn is_frame(path: &Path) -> bool {
    let mut head = Vec::new();
    let read = input::open(path).and_then(|file| file.take(HEAD_BYTES).read_to_end(&mut head));
    let head = String::from_utf8_lossy(&head);
    read.is_ok() && (head.contains("\"people\"") || !MULTI_FRAME_KEYS.iter().any(|key| head.contains(key)))
}

/// Name of the video that a keypoint or sound file belongs to: the lower-case file name without extension, `PREFIXES`
/// and `SUFFIXES`.
pub fn video_name(path: &Path) -> String {
    let name = if path.is_dir() { path.file_name() } else { path.file_stem() };
    let name = composed(&name.unwrap_or_default().to_string_lossy()).to_lowercase();
    let name = PREFIXES.iter().fold(&*name, |name, prefix| name.strip_prefix(prefix).unwrap_or(name));
    SUFFIXES.iter().fold(name, |name, suffix| name.strip_suffix(suffix).unwrap_or(name)).to_owned()
}
