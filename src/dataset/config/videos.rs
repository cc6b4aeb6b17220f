//! Resolution of the speakers' `videos` entries to units: patterns are expanded, folders are listed, and every video
//! gets its work name. A path that does not exist becomes a unit too, so that it fails by itself and the others are
//! processed.

use super::keypoints::{self, KeypointSource};
use super::patterns::{self, ANY_CASE, SearchRoot};
use super::{Config, SpeakerConfig, transcripts};
use crate::decisions::Decision;
use crate::file_name;
use orator_base::stage::Unit;
use orator_base::stage::artifacts::Artifact;
use orator_base::text::composed;
use orator_base::types::split::Split;
use orator_formats::search;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Videos of one speaker.
#[derive(Clone, Debug, Default)]
pub struct Videos {
    pub speaker: String,
    /// Units sorted by work name, each once.
    pub units: Vec<Unit>,
    /// Videos given as keypoints of other programs, by work name.
    pub keypoints: BTreeMap<String, KeypointSource>,
    /// Files that may be the transcript, by the work name of the video.
    pub transcripts: BTreeMap<String, Vec<PathBuf>>,
    /// Splits named in the configuration, by the work name of the video.
    pub splits: BTreeMap<String, Split>,
    /// Decisions of users about the videos; empty until `decisions::attach`.
    pub decisions: Vec<Decision>,
    /// Messages about entries of the configuration that have no effect, each with advice.
    pub missing: Vec<String>,
    /// Names of the files in folders of `videos` that are not videos, without transcripts if those are configured.
    pub passed_over: Vec<String>,
}

impl Videos {
    /// Whether the pose models may be needed: false only if all videos are given as keypoints.
    pub fn has_video_files(&self) -> bool {
        self.keypoints.is_empty() || self.units.len() > self.keypoints.len()
    }
}

/// Videos of all speakers of the configuration.
pub fn all(config: &Config) -> Vec<Videos> {
    let settings = &config.settings;
    let folder = config.file.parent().unwrap_or(Path::new("."));
    let root = SearchRoot::new(folder, &[&settings.work.dir, &settings.models.dir]);
    let with_words = |speaker: &SpeakerConfig| {
        let mut videos = of_speaker(speaker, &root);
        if speaker.transcribes() {
            let words = |unit: &Unit| (unit.video.clone(), vec![Artifact::Words.path(&settings.work.dir, unit)]);
            videos.transcripts = videos.units.iter().map(words).collect();
        }
        videos
    };
    settings.speaker.iter().map(with_words).collect()
}

/// Videos of one speaker: those its patterns name below the search root `root`, without the excluded ones.
pub fn of_speaker(speaker: &SpeakerConfig, root: &SearchRoot) -> Videos {
    let folder = root.folder.as_path();
    let mut found = BTreeMap::new();
    let (mut missing, mut passed_over) = (Vec::new(), Vec::new());
    for entry in &speaker.videos {
        let videos = ("video", &patterns::VIDEO_EXTENSIONS[..]);
        let paths = patterns::expand(entry, root, videos, &mut missing).unwrap_or_else(|message| {
            missing.push(message);
            Vec::new()
        });
        for path in paths {
            missing.extend(add(&mut found, &speaker.name, path, folder).err());
        }
        passed_over.extend(other_files(&search::existing(&folder.join(entry)), !speaker.transcripts.is_empty()));
    }
    let mut given = BTreeMap::new();
    for (path, source) in keypoints::of_speaker(speaker, root, &mut missing) {
        match add(&mut found, &speaker.name, path, folder) {
            Ok(video) => drop(given.insert(video, source)),
            Err(message) => missing.push(message),
        }
    }
    found.retain(|_, unit: &mut Unit| !speaker.exclude.iter().any(|entry| names(entry, &unit.source, folder)));
    for entry in speaker.mirrored.iter().filter(|entry| !entry.contains(['*', '?', '['])) {
        if !found.values().any(|unit| names(entry, &unit.source, folder)) {
            missing.push(format!("mirrored = [{entry:?}]: no video has this name: correct or remove the entry"));
        }
    }
    let mut splits = BTreeMap::new();
    let lists = [&speaker.train, &speaker.validation, &speaker.test];
    for (split, entries) in Split::ALL.into_iter().zip(lists) {
        for entry in entries {
            let named = found.values().filter(|unit| names(entry, &unit.source, folder));
            let before: Vec<(String, Option<Split>)> =
                named.map(|unit| (unit.video.clone(), splits.insert(unit.video.clone(), split))).collect();
            let list = split.name();
            if before.is_empty() && !entry.contains(['*', '?', '[']) {
                missing.push(format!("{list} = [{entry:?}]: no video has this name: correct or remove the entry"));
            }
            for other in before.iter().filter_map(|(_, was)| was.filter(|was| *was != split)) {
                missing.push(format!("{entry:?} is listed in {} and in {list}: remove one", other.name()));
            }
        }
    }
    given.retain(|video, _| found.contains_key(video));
    let units: Vec<Unit> = found.into_values().collect();
    let transcripts = transcripts::of_speaker(speaker, &units, root, &mut missing);
    let decisions = Vec::new();
    let speaker = speaker.name.clone();
    Videos { speaker, units, keypoints: given, transcripts, splits, decisions, missing, passed_over }
}

/// Names of the files of a folder that are not videos, without hidden files; empty for a file or a pattern.
fn other_files(folder: &Path, has_transcripts: bool) -> Vec<String> {
    let is_other = |path: &PathBuf| {
        let is_hidden = path.file_name().unwrap_or_default().to_string_lossy().starts_with('.');
        let is_transcript = has_transcripts && patterns::has_extension(path, &patterns::TRANSCRIPT_EXTENSIONS);
        path.is_file() && !is_hidden && !is_transcript && !patterns::has_extension(path, &patterns::VIDEO_EXTENSIONS)
    };
    let files = if folder.is_dir() { patterns::list(folder).unwrap_or_default() } else { Vec::new() };
    files.iter().filter(|path| is_other(path)).map(|path| file_name(path)).collect()
}

/// Adds a video under its work name and returns the name.
fn add(found: &mut BTreeMap<String, Unit>, speaker: &str, path: PathBuf, folder: &Path) -> Result<String, String> {
    if path.to_str().is_none() {
        return Err(patterns::not_utf8_message(&path));
    }
    let video = work_name(&path, folder);
    let new = || Unit { speaker: speaker.to_owned(), video: video.clone(), source: path.clone() };
    let unit = found.entry(video.clone()).or_insert_with(new);
    if unit.source == path {
        return Ok(video);
    }
    let (first, second) = (unit.source.display(), path.display());
    Err(format!("{first} and {second} would both be named {video} in the work folder: rename the second"))
}

/// Whether an entry refers to the video: by its path, its file name, or a pattern for one of them.
pub fn names(entry: &str, video: &Path, folder: &Path) -> bool {
    let text = |path: &Path| composed(&path.to_string_lossy());
    let (entry, file_name) = (composed(entry), text(Path::new(video.file_name().unwrap_or_default())));
    if Path::new(&text(&folder.join(&entry))) == Path::new(&text(video)) || entry == file_name {
        return true;
    }
    let relative = text(video.strip_prefix(folder).unwrap_or(video));
    let matches =
        |pattern: glob::Pattern| [&relative, &file_name].iter().any(|name| pattern.matches_with(name, ANY_CASE));
    glob::Pattern::new(&entry).is_ok_and(matches)
}

/// Work name `<slug of the stem>-<8 hex of BLAKE3 of the path relative to the configuration>`: it does not change when
/// videos are added, and differs for equal file names in two folders.
pub fn work_name(path: &Path, folder: &Path) -> String {
    let relative = path.strip_prefix(folder).unwrap_or(path).to_string_lossy().replace('\\', "/");
    let hash = blake3::hash(relative.as_bytes()).to_hex();
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    format!("{}-{}", slug(&stem), &hash[..8])
}

/// Converts text to lower-case ASCII letters, digits and single dashes, at most 40 characters; `video` if nothing is
/// left.
pub fn slug(text: &str) -> String {
    let mut slug = String::new();
    for c in text.chars().flat_map(char::to_lowercase) {
        if c.is_ascii_alphanumeric() {
            slug.push(c);
        } else if !slug.is_empty() && !slug.ends_with('-') {
            slug.push('-');
        }
        if slug.len() == 40 {
            break;
        }
    }
    let slug = slug.trim_end_matches('-');
    if slug.is_empty() { "video".to_owned() } else { slug.to_owned() }
}
