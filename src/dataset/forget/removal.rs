//! Removal of a video's data. First, a marker file in the dataset makes `dataset verify` fail until the removal is
//! complete; then the files of the stages are removed; last, the dataset is atomically replaced by one without the
//! video. After a kill at any point, a second run completes the removal.

use super::dataset;
use super::known::KnownVideo;
use super::search::SearchTerm;
use crate::decisions::{self, Decision};
use crate::file_name;
use crate::split::SplitRecord;
use anyhow::{Context, Result};
use orator_base::stage::artifacts::{self, StageName, speaker_dir};
use orator_base::stage::fingerprint::hash_file;
use orator_base::stage::{record, workdir};
use orator_base::text::counted;
use orator_formats::checkpoint;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Name of the marker file in a dataset while one of its videos is being forgotten.
pub const PENDING: &str = "FORGETTING.txt";

/// Default folders of a speaker's trained models.
pub fn models_dirs(work: &Path, speaker: &str) -> [PathBuf; 2] {
    ["gan", "seq2seq"].map(|kind| work.join(kind).join(speaker))
}

/// Model folders, of any speaker, whose checkpoint metadata lists one of the videos: the model, or the one that it was
/// initialised from, was trained on it.
pub fn models_trained_on(work: &Path, videos: &[&KnownVideo]) -> Result<Vec<PathBuf>> {
    let contents: BTreeSet<&str> = videos.iter().filter_map(|video| video.content.as_deref()).collect();
    let mut folders = Vec::new();
    for kind in ["gan", "seq2seq"] {
        for folder in list_sorted(&work.join(kind))? {
            let mut checkpoints = list_sorted(&folder)?;
            checkpoints.retain(|path| path.extension().is_some_and(|ending| ending == "safetensors"));
            // All checkpoints of a folder list the same videos. An unreadable one is skipped: the search covers it.
            let facts = checkpoints.iter().find_map(|path| checkpoint::facts(path).ok()).unwrap_or_default();
            let listed = facts["speaker"]["videos"].as_array().into_iter().flatten();
            let mut hashes = listed.filter_map(|video| video["content"].as_str());
            if hashes.any(|hash| contents.contains(hash)) {
                folders.push(folder);
            }
        }
    }
    Ok(folders)
}

/// Data to remove for some or all videos of a speaker.
#[derive(Clone, Debug, Default)]
pub struct Removal {
    pub speaker: String,
    /// Files and folders of the stages (results, records, failures, attempts, pictures) and reports that name a video.
    pub paths: Vec<PathBuf>,
    /// Folders of models trained on the videos.
    pub models: Vec<PathBuf>,
    /// Dataset folder, and the names of the videos to remove from it.
    pub dataset: Option<(PathBuf, BTreeSet<String>)>,
    /// File of content hashes, and the number of entries to remove from it.
    pub hashes: Option<(PathBuf, usize)>,
    /// Split record, and the number of videos to remove from it.
    pub splits: Option<(PathBuf, usize)>,
    /// Configuration file, and the decisions beside it to remove.
    pub decisions: Option<(PathBuf, Vec<String>)>,
    /// Names and hashes of the videos, which must not be found afterwards.
    pub terms: Vec<SearchTerm>,
}

impl Removal {
    /// Plans the removal of the data of `videos` from the work folder; `others` are the remaining videos, and
    /// `whole_speaker` means that all videos of the speaker go.
    pub fn of_work(
        work: &Path,
        speaker: &str,
        videos: &[&KnownVideo],
        others: &[&KnownVideo],
        whole_speaker: bool,
    ) -> Result<Self> {
        let mut removal = Self { speaker: speaker.to_owned(), terms: terms(videos, others), ..Self::default() };
        for folder in StageName::OF_VIDEOS.map(StageName::as_str).into_iter().chain(["sheets"]) {
            let folder = work.join(folder).join(speaker);
            if whole_speaker {
                removal.paths.extend(Some(folder).filter(|folder| folder.exists()));
                continue;
            }
            let own: Vec<&String> = videos.iter().filter_map(|video| video.work.as_ref()).collect();
            for path in list_sorted(&folder)? {
                let name = file_name(&path);
                let name = name.trim_start_matches('.');
                let is_of = |work: &&String| {
                    name.strip_prefix(work.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '_']))
                };
                removal.paths.extend(own.iter().any(is_of).then_some(path));
            }
        }
        let names_one = |path: &PathBuf| fs::read(path).is_ok_and(|bytes| super::search::is_in(&bytes, &removal.terms));
        let reports: Vec<PathBuf> = report_pages(work)?.into_iter().filter(names_one).collect();
        removal.paths.extend(reports);
        let dir = speaker_dir(work, StageName::Dataset, speaker);
        let names: BTreeSet<String> = videos.iter().flat_map(|video| video.parts.iter().cloned()).collect();
        let has_samples = names.iter().any(|name| dataset::has_samples(&dir, name));
        let models = models_dirs(work, speaker).into_iter();
        removal.models.extend(models.filter(|models| models.exists() && (whole_speaker || has_samples)));
        let others = models_trained_on(work, videos)?;
        removal.models.extend(others);
        removal.models.sort();
        removal.models.dedup();
        let left_over = workdir::left_over(&dir);
        if !names.is_empty() || (whole_speaker && dir.exists()) || dir.join(PENDING).exists() {
            removal.dataset = Some((dir.clone(), names));
            // The record of the dataset stage has the videos as inputs; results or a failure may name their files.
            removal
                .paths
                .extend([record::record_path(&dir), record::failure_path(&dir)].into_iter().filter(|p| p.exists()));
        }
        removal.paths.extend(left_over);
        removal.paths.extend(Some(artifacts::faces(work, speaker)).filter(|picture| picture.exists()));
        let splits = artifacts::splits(work, speaker);
        removal.paths.extend(workdir::left_over(&splits));
        removal.paths.extend(workdir::left_over(&artifacts::hashes(work)));
        match SplitRecord::read(&splits) {
            Ok(Some(mut record)) if !whole_speaker => {
                let n = removal.clean_record(&mut record);
                removal.splits = (n > 0).then_some((splits, n));
            }
            Ok(None) => {}
            // An unreadable record may contain the video.
            Ok(Some(_)) | Err(_) => removal.paths.push(splits),
        }
        removal.hashes = matching_hashes(&artifacts::hashes(work), &removal);
        Ok(removal)
    }

    /// Adds the decisions beside `config` about `videos`.
    ///
    /// # Errors
    /// An invalid `decisions.toml`.
    pub fn add_decisions(&mut self, config: &Path, videos: &[&KnownVideo]) -> Result<()> {
        let is_about = |one: &Decision| {
            videos.iter().any(|video| video.speaker == one.speaker && video.work.as_ref() == Some(&one.video))
        };
        let about: Vec<Decision> = decisions::read(config)?.into_iter().filter(is_about).collect();
        let ids: Vec<String> = about.into_iter().map(|one| one.id).collect();
        self.decisions = (!ids.is_empty()).then(|| (config.to_owned(), ids));
        Ok(())
    }

    /// Plans the removal of `videos` from a dataset folder without a work folder.
    pub fn of_dataset(dir: &Path, videos: &[&KnownVideo], others: &[&KnownVideo]) -> Self {
        let names = videos.iter().flat_map(|video| video.parts.iter().cloned()).collect();
        let paths = workdir::left_over(dir);
        Self { dataset: Some((dir.to_owned(), names)), terms: terms(videos, others), paths, ..Self::default() }
    }

    /// Whether there is nothing to remove.
    pub fn is_empty(&self) -> bool {
        self.paths.is_empty()
            && self.models.is_empty()
            && self.dataset.is_none()
            && self.hashes.is_none()
            && self.splits.is_none()
            && self.decisions.is_none()
    }

    /// One line for each thing that is removed.
    pub fn lines(&self, keep_models: bool) -> Vec<String> {
        let mut lines: Vec<String> = self.paths.iter().map(|path| path.display().to_string()).collect();
        if let Some((path, n)) = &self.hashes {
            lines.push(format!("{} of {}", counted(*n, "entry"), path.display()));
        }
        if let Some((path, n)) = &self.splits {
            lines.push(format!("{} of {}", counted(*n, "entry"), path.display()));
        }
        if let Some((config, ids)) = &self.decisions {
            lines.push(format!("{} of {}", counted(ids.len(), "decision"), decisions::path(config).display()));
        }
        if let Some((dir, names)) = &self.dataset {
            lines.extend(names.iter().map(|name| format!("{name} of the dataset {}", dir.display())));
        }
        if !keep_models {
            lines.extend(self.models.iter().map(|path| format!("{} (trained on it)", path.display())));
        }
        lines
    }

    /// Carries out the removal, including trained models unless `keep_models`.
    ///
    /// # Errors
    /// A damaged file of a remaining video (detected before any removal), or a file that cannot be removed or written.
    pub fn carry_out(&self, keep_models: bool) -> Result<()> {
        if let Some((dir, names)) = &self.dataset {
            dataset::ensure_intact_without(dir, names)?;
        }
        if let Some((dir, _)) = self.dataset.as_ref().filter(|(dir, _)| dir.exists()) {
            let text = "A video of this dataset is being forgotten. Run the same `orator forget` again to finish.\n";
            workdir::write_file(&dir.join(PENDING), text.as_bytes())?;
        }
        let models = self.models.iter().filter(|_| !keep_models);
        for path in self.paths.iter().chain(models) {
            remove(path)?;
        }
        if let Some((path, _)) = &self.hashes {
            self.clean_hashes(path)?;
        }
        if let Some((path, _)) = &self.splits
            && let Some(mut record) = SplitRecord::read(path)?
        {
            self.clean_record(&mut record);
            if record.videos.is_empty() { remove(path)? } else { record.write(path)? }
        }
        if let Some((dir, names)) = &self.dataset {
            dataset::without(dir, names)?;
        }
        if let Some((config, ids)) = &self.decisions {
            ids.iter().try_for_each(|id| decisions::remove(config, id).map(drop))?;
        }
        Ok(())
    }

    /// Removes the videos from a split record; returns their number.
    fn clean_record(&self, record: &mut SplitRecord) -> usize {
        let is_named = |name: &str| self.dataset.as_ref().is_some_and(|(_, names)| names.contains(name));
        record.forget(|content, video| {
            is_named(&video.name) || super::search::is_in(format!("{content}\n{}", video.name).as_bytes(), &self.terms)
        })
    }

    fn clean_hashes(&self, path: &Path) -> Result<()> {
        let mut table = read_table(path);
        table.retain(|file, known| !self.is_own_hash(file, known));
        workdir::write_file(path, &serde_json::to_vec(&table)?)
    }

    /// Whether an entry of the hash table belongs to a removed file or names one of the videos.
    fn is_own_hash(&self, file: &str, known: &serde_json::Value) -> bool {
        let entry = format!("{file}\n{known}");
        let gone = self.paths.iter().any(|path| Path::new(file).starts_with(path));
        let in_dataset = self.dataset.as_ref().is_some_and(|(dir, _)| Path::new(file).starts_with(dir));
        gone || in_dataset || super::search::is_in(entry.as_bytes(), &self.terms)
    }
}

type JsonObject = serde_json::Map<String, serde_json::Value>;

fn read_table(path: &Path) -> JsonObject {
    fs::read(path).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok()).unwrap_or_default()
}

fn matching_hashes(path: &Path, removal: &Removal) -> Option<(PathBuf, usize)> {
    let n = read_table(path).iter().filter(|(file, known)| removal.is_own_hash(file, known)).count();
    (n > 0).then(|| (path.to_owned(), n))
}

/// HTML reports in the work folder, sorted; they can be generated again.
fn report_pages(work: &Path) -> Result<Vec<PathBuf>> {
    let (mut pages, mut folders) = (Vec::new(), vec![work.to_owned()]);
    while let Some(folder) = folders.pop() {
        for path in list_sorted(&folder)? {
            if path.is_dir() && !path.is_symlink() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "html") && path.is_file() {
                pages.push(path);
            }
        }
    }
    pages.sort();
    Ok(pages)
}

fn list_sorted(folder: &Path) -> Result<Vec<PathBuf>> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let listing = || format!("cannot list {}", folder.display());
    let entries = fs::read_dir(folder).with_context(listing)?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>().with_context(listing)?;
    paths.sort();
    Ok(paths)
}

fn remove(path: &Path) -> Result<()> {
    workdir::remove(path).with_context(|| format!("cannot remove {}", path.display()))
}

/// Search terms for `videos`: work names, dataset names and paths, file names and hashes that no other video shares.
fn terms(videos: &[&KnownVideo], others: &[&KnownVideo]) -> Vec<SearchTerm> {
    let mut terms: Vec<SearchTerm> = Vec::new();
    for video in videos {
        terms.extend(video.work.iter().flat_map(|name| SearchTerm::name("work name", name)));
        terms.extend(video.parts.iter().flat_map(|name| SearchTerm::name("dataset name", name)));
        if !video.file.is_empty() && others.iter().all(|other| other.file != video.file) {
            terms.extend(SearchTerm::name("file name", &video.file));
        }
        let source = video.source.as_ref().map(|source| source.to_string_lossy().into_owned());
        terms.extend(source.iter().flat_map(|path| SearchTerm::name("path", path)));
        let hashed = || video.source.as_ref().and_then(|source| hash_file(source).ok());
        let content = video.content.clone().or_else(hashed);
        if let Some(content) = content.filter(|c| others.iter().all(|other| other.content.as_ref() != Some(c))) {
            terms.extend(SearchTerm::hash("content hash", &content));
            terms.extend(content.get(..8).map(|key| SearchTerm::hash("key", key)).into_iter().flatten());
        }
    }
    terms
}

#[cfg(test)]
mod tests {
    use super::*;
    use safetensors::tensor::TensorView;

    #[test]
    fn a_model_trained_on_one_of_the_videos_is_found() {
        let work = tempfile::tempdir().unwrap();
        let model = |name: &str, hashes: &[&str]| {
            let videos: Vec<_> =
                hashes.iter().map(|hash| serde_json::json!({"speaker": "a", "content": hash})).collect();
            let facts = serde_json::json!({ "speaker": { "videos": videos } });
            let folder = work.path().join("gan").join(name);
            fs::create_dir_all(&folder).unwrap();
            let bytes = checkpoint::to_bytes(&facts, Vec::<(String, TensorView)>::new()).unwrap();
            fs::write(folder.join("best.safetensors"), bytes).unwrap();
            folder
        };
        let (both, _other) = (model("ben", &["aa11", "bb22"]), model("cleo", &["cc33"]));
        fs::write(work.path().join("gan/ben/step-0000001.safetensors"), "half").unwrap();
        let video = KnownVideo { content: Some("aa11".to_owned()), ..KnownVideo::default() };
        assert_eq!(models_trained_on(work.path(), &[&video]).unwrap(), [both]);
        let unknown = KnownVideo::default();
        assert!(models_trained_on(work.path(), &[&unknown]).unwrap().is_empty());
    }
}
