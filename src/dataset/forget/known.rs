//! List of all videos of a project, collected from its configuration, work folder and datasets, and selection of one by
//! path, file name, work name or dataset name.

use crate::config::{Config, videos};
use crate::file_name;
use crate::split::SplitRecord;
use crate::write::entry::{self, VideoEntry};
use anyhow::{Result, bail, ensure};
use orator_base::stage::artifacts::{self, StageName, speaker_dir};
use orator_base::stage::fingerprint::hash_file;
use orator_base::stage::parts::PARTS;
use orator_base::stage::record::Record;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Video with all the names under which its data is stored.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct KnownVideo {
    pub speaker: String,
    /// Work name; `None`: known only from a dataset or a split record.
    pub work: Option<String>,
    /// Path in the configuration.
    pub source: Option<PathBuf>,
    /// BLAKE3 of the content; `None`: not recorded.
    pub content: Option<String>,
    /// File name; empty for a video known only from the folders of stages.
    pub file: String,
    /// Names in the speaker's dataset.
    pub parts: BTreeSet<String>,
}

impl KnownVideo {
    /// `speaker/name`, shown to the user.
    pub fn display_name(&self) -> String {
        let name = self.work.as_ref().or(self.parts.first()).cloned().unwrap_or_else(|| self.file.clone());
        format!("{}/{name}", self.speaker)
    }

    fn matches(&self, wanted: &str) -> bool {
        let path = Path::new(wanted);
        let same_path = |source: &PathBuf| {
            source == path
                || std::path::absolute(path).is_ok_and(|path| path == *source)
                || path.canonicalize().is_ok_and(|path| source.canonicalize().is_ok_and(|source| source == path))
        };
        let stem = Path::new(&self.file).file_stem().is_some_and(|stem| stem == wanted);
        self.work.as_deref() == Some(wanted)
            || self.parts.contains(wanted)
            || self.file == wanted
            || stem
            || self.source.as_ref().is_some_and(same_path)
    }
}

/// All videos of a project, including those that the configuration excludes.
pub fn project_videos(config: &Config) -> Result<Vec<KnownVideo>> {
    let work = &config.settings.work.dir;
    let mut all = config.clone();
    all.settings.speaker.iter_mut().for_each(|speaker| speaker.exclude.clear());
    let mut known: Vec<KnownVideo> = Vec::new();
    for unit in videos::all(&all).into_iter().flat_map(|videos| videos.units) {
        let content = content(work, &unit.speaker, &unit.video);
        let file = file_name(&unit.source);
        let (speaker, work, source) = (unit.speaker, Some(unit.video), Some(unit.source));
        known.push(KnownVideo { speaker, work, source, content, file, parts: BTreeSet::new() });
    }
    for stage in StageName::OF_VIDEOS {
        for speaker in folders(&work.join(stage.as_str())) {
            for video in entries(&speaker_dir(work, stage, &speaker)) {
                let is_known = known.iter().any(|k| k.speaker == speaker && k.work.as_ref() == Some(&video));
                if !is_known {
                    let content = content(work, &speaker, &video);
                    known.push(KnownVideo {
                        speaker: speaker.clone(),
                        work: Some(video),
                        content,
                        ..KnownVideo::default()
                    });
                }
            }
        }
    }
    for speaker in folders(&work.join(StageName::Dataset.as_str())) {
        add_dataset(&speaker_dir(work, StageName::Dataset, &speaker), &speaker, &mut known)?;
    }
    for speaker in speakers_on_record(work) {
        let Ok(Some(record)) = SplitRecord::read(&artifacts::splits(work, &speaker)) else { continue };
        for (content, video) in record.videos {
            let is_it = |k: &KnownVideo| {
                k.speaker == speaker && (k.content.as_ref() == Some(&content) || k.parts.contains(&video.name))
            };
            if !known.iter().any(is_it) {
                let (speaker, parts) = (speaker.clone(), [video.name.clone()].into());
                known.push(KnownVideo {
                    speaker,
                    content: Some(content),
                    file: video.name,
                    parts,
                    ..KnownVideo::default()
                });
            }
        }
    }
    known.sort();
    Ok(known)
}

/// Names of the speakers that have a split record.
fn speakers_on_record(work: &Path) -> Vec<String> {
    let files = artifacts::splits(work, "");
    let entries = std::fs::read_dir(files.parent().unwrap_or(work)).into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    names
        .filter_map(|name| name.strip_suffix(".json").map(str::to_owned))
        .filter(|name| !name.starts_with('.'))
        .collect()
}

pub fn dataset_videos(dir: &Path) -> Result<Vec<KnownVideo>> {
    ensure!(dir.join(entry::FOLDER).is_dir(), "{} is not a dataset: it has no folder {}", dir.display(), entry::FOLDER);
    let mut known = Vec::new();
    add_dataset(dir, "", &mut known)?;
    Ok(known)
}

/// Adds the videos of a dataset; one whose name or content is already known is merged into that video.
fn add_dataset(dir: &Path, speaker: &str, known: &mut Vec<KnownVideo>) -> Result<()> {
    if !dir.join(entry::FOLDER).is_dir() {
        return Ok(());
    }
    for name in entry::names(dir)? {
        // The name is known even if the entry is damaged, so such a video can be forgotten too.
        let entry = VideoEntry::read(&VideoEntry::path(dir, &name)).ok();
        let (content, file) = entry.map(|entry| (entry.content, entry.file)).unwrap_or_default();
        let is_in_project = |k: &&mut KnownVideo| k.speaker == speaker && k.work.is_some();
        let named = known.iter_mut().filter(is_in_project).find(|k| k.work.as_ref() == Some(&name));
        let named = named.map(|k| k.parts.insert(name.clone()));
        if named.is_some() {
            continue;
        }
        // Without a record of the extract stage, the video file is hashed to find its content.
        for k in known.iter_mut().filter(is_in_project).filter(|k| k.content.is_none() && k.file == file) {
            k.content = k.source.as_ref().and_then(|source| hash_file(source).ok());
        }
        let has_same_content = |k: &KnownVideo| {
            k.speaker == speaker && k.work.is_some() && !content.is_empty() && k.content.as_ref() == Some(&content)
        };
        let exact = known.iter().position(|k| has_same_content(k) && k.file == file);
        let first = exact.or_else(|| known.iter().position(has_same_content)).and_then(|at| known.get_mut(at));
        match first {
            Some(k) => {
                k.parts.insert(name);
            }
            None => {
                let content = Some(content).filter(|content| !content.is_empty());
                let (speaker, parts) = (speaker.to_owned(), [name].into());
                known.push(KnownVideo { speaker, work: None, source: None, content, file, parts });
            }
        }
    }
    Ok(())
}

/// Content hash of a video from the record of the extract stage.
fn content(work: &Path, speaker: &str, video: &str) -> Option<String> {
    let record = Record::read(&speaker_dir(work, StageName::Extract, speaker).join(video))?;
    record.fingerprint.inputs.get("video").cloned()
}

fn folders(dir: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(dir).into_iter().flatten().flatten().filter(|entry| entry.path().is_dir());
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = names.filter(|name| !name.starts_with('.') && !name.ends_with(PARTS)).collect();
    names.sort();
    names
}

/// Names of the units in a stage's folder, from result folders, records, failures and unfinished attempts.
fn entries(dir: &Path) -> BTreeSet<String> {
    let entries = std::fs::read_dir(dir).into_iter().flatten().flatten();
    let name = |name: String| {
        let name = name.trim_start_matches('.');
        let end = [".record.", ".failed.", ".attempt", ".old", PARTS].iter().filter_map(|mark| name.find(mark)).min();
        name[..end.unwrap_or(name.len())].to_owned()
    };
    let names = entries.map(|entry| name(entry.file_name().to_string_lossy().into_owned()));
    names.filter(|name| !name.is_empty()).collect()
}

/// Finds the only video that the path or name `wanted` refers to, among those of `speaker` if given.
///
/// # Errors
/// No video or several; the message lists them.
pub fn find_one<'a>(known: &'a [KnownVideo], wanted: &str, speaker: Option<&str>) -> Result<&'a KnownVideo> {
    let all: Vec<&KnownVideo> = known.iter().filter(|k| speaker.is_none_or(|speaker| k.speaker == speaker)).collect();
    let list = |videos: &[&KnownVideo]| {
        let line = |k: &&KnownVideo| match &k.source {
            Some(source) => format!("\n  {}  {}", k.display_name(), source.display()),
            None => format!("\n  {}  {}", k.display_name(), k.file),
        };
        videos.iter().map(line).collect::<Vec<_>>().concat()
    };
    let called: Vec<&KnownVideo> = all.iter().copied().filter(|k| k.matches(wanted)).collect();
    match called.as_slice() {
        [one] => Ok(one),
        [] => bail!("unknown video {wanted}: expected one of{}", list(&all)),
        several => bail!("{wanted} matches several videos: give the work name or path of one of{}", list(several)),
    }
}

/// All videos of a speaker.
///
/// # Errors
/// An unknown speaker; the message lists the speakers.
pub fn speaker_videos<'a>(known: &'a [KnownVideo], speaker: &str) -> Result<Vec<&'a KnownVideo>> {
    let own: Vec<&KnownVideo> = known.iter().filter(|k| k.speaker == speaker).collect();
    let names: BTreeSet<&str> = known.iter().map(|k| k.speaker.as_str()).collect();
    let names = names.into_iter().collect::<Vec<_>>().join(", ");
    ensure!(!own.is_empty(), "unknown speaker {speaker}: expected one of {names}");
    Ok(own)
}
