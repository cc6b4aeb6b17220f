//! Items of an import: a take, a video of another dataset, or the samples of a video in loose tar files. Each item is
//! inspected first (outcome, ledger, sound codes) and written after its split has been assigned.

use super::find::{ImportSources, TakeFiles};
use super::shards::{self, ShardSample, ShardVideo};
use super::take::{ImportedTake, TakeOutcome};
use super::write::{ImportOutcome, ImportPlan};
use crate::bones::{VideoBones, of_speaker};
use crate::config::videos::slug;
use crate::info::DatasetInfo;
use crate::shared_sound::SharedSound;
use crate::split::{Assignment, SplitBy, TimeBlock};
use crate::write::assemble::DatasetWriter;
use crate::write::entry::{self, VideoEntry, VideoSource};
use crate::{INFO, Split, file_name, read_json};
use anyhow::{Result, ensure};
use orator_base::audio::fingerprint::Fingerprinter;
use orator_base::motion::bones;
use orator_base::stage::fingerprint::hash_file;
use orator_base::stage::ledger::{AcceptedInterval, Ledger, RejectedInterval, TranscriptReport, WordCount};
use orator_base::stage::rejection::{FrameRejection, Rejection};
use orator_base::text::number;
use orator_formats::joints_description::path_of;
use orator_formats::mocap::bvh;
use std::path::{Path, PathBuf};

/// Median shift of a take's joints by fixing the bone lengths, mm, above which a note is given.
const NOTABLE_SHIFT_MM: f64 = 5.0;

#[derive(Clone, Debug)]
pub enum ImportItem {
    Take(TakeFiles),
    /// Dataset folder, and the name of a video in it.
    Part(PathBuf, String),
    ShardVideo(ShardVideo),
    /// Unreadable file that looks like motion, with the reason.
    Unknown(PathBuf, String),
}

#[derive(Clone, Debug, Default)]
pub struct InspectedItem {
    pub source: VideoSource,
    /// Split or blocks stated by the source; replaced by the assigned ones later.
    pub split: Option<Assignment>,
    /// Sound fingerprint codes; `None`: no sound, or the codes are already written.
    pub codes: Option<Vec<u32>>,
    /// Remark for the user on an accepted take; may be empty.
    pub note: String,
    /// BLAKE3 of the written sound codes.
    pub sound: Option<String>,
}

impl ImportItem {
    /// All items of the sources, and notes on the files skipped in their tar files.
    pub fn all(sources: &ImportSources) -> (Vec<Self>, Vec<String>) {
        let mut items: Vec<Self> = sources.takes.iter().cloned().map(Self::Take).collect();
        for dir in &sources.datasets {
            match entry::names(dir) {
                Ok(names) => items.extend(names.into_iter().map(|name| Self::Part(dir.clone(), name))),
                Err(error) => items.push(Self::Unknown(dir.clone(), format!("{error:#}"))),
            }
        }
        let loose = shards::open(&sources.tars);
        items.extend(loose.videos.into_iter().map(Self::ShardVideo));
        let unknown = loose.failed.into_iter().chain(sources.unknown.iter().cloned());
        items.extend(unknown.map(|(path, why)| Self::Unknown(path, why)));
        (items, loose.notes)
    }

    /// Name shown to the user.
    pub fn file(&self) -> String {
        match self {
            Self::Take(TakeFiles { origin: Some(path), .. } | TakeFiles { motion: path, .. })
            | Self::Unknown(path, _) => path.display().to_string(),
            Self::Part(dir, name) => format!("{} of {}", name, dir.display()),
            Self::ShardVideo(video) => video.name.clone(),
        }
    }

    /// Folders that hold the item's files, sorted, each once.
    fn folders(&self) -> Vec<String> {
        let files: Vec<&PathBuf> = match self {
            Self::Take(found) => found.files().collect(),
            Self::Part(path, _) | Self::Unknown(path, _) => vec![path],
            Self::ShardVideo(video) => video.tars(),
        };
        let folders = files.into_iter().filter_map(|path| path.parent()).map(|dir| dir.display().to_string());
        let mut folders: Vec<String> = folders.filter(|dir| !dir.is_empty()).collect();
        folders.sort();
        folders.dedup();
        folders
    }

    /// Inspects the item; an unreadable item yields a failure.
    pub fn inspect(&self, plan: &ImportPlan) -> InspectedItem {
        let inspected = match self {
            Self::Take(found) => inspect_take(found, plan),
            Self::Part(dir, name) => inspect_entry(dir, name, plan),
            Self::ShardVideo(video) => inspect_shard_video(video, plan),
            Self::Unknown(_, why) => Err(anyhow::anyhow!("{why}")),
        };
        inspected.unwrap_or_else(|error| self.failed(&format!("{error:#}")))
    }

    fn failed(&self, error: &str) -> InspectedItem {
        let (path, name) = match self {
            Self::Take(TakeFiles { motion: path, .. }) | Self::Unknown(path, _) => (path.clone(), None),
            Self::Part(dir, name) => (dir.clone(), Some(name.clone())),
            Self::ShardVideo(video) => (PathBuf::from(&video.name), Some(video.name.clone())),
        };
        // Local folder names must not end up in the dataset.
        let error = self.folders().iter().fold(error.to_owned(), |error, dir| error.replace(&format!("{dir}/"), ""));
        let content = hash_file(&path).unwrap_or_default();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let hash =
            if content.is_empty() { blake3::hash(stem.as_bytes()).to_hex().to_string() } else { content.clone() };
        let source = VideoSource {
            name: name
                .filter(|name| entry::check_name(name).is_ok())
                .unwrap_or_else(|| format!("{}-{}", slug(&stem), hash.get(..8).unwrap_or_default())),
            file: file_name(&path),
            content,
            failure: Some(format!("import: {error}")),
            ..VideoSource::default()
        };
        InspectedItem { source, ..InspectedItem::default() }
    }

    /// Writes the item into the dataset in `out` according to its inspection.
    pub fn write(
        &self,
        inspected: &InspectedItem,
        plan: &ImportPlan,
        writer: &DatasetWriter,
        out: &Path,
    ) -> Result<()> {
        let source = inspected.source.clone();
        let assignment = inspected.split.clone().filter(|_| inspected.is_accepted());
        if let (Self::Part(dir, name), Some(_)) = (self, &assignment) {
            return VideoEntry::read(&VideoEntry::path(dir, name))?.link_into(dir, out);
        }
        let (whole, mut entry) = match assignment {
            Some(Assignment::In(split, by)) => (Some(split), writer.video(source, split, by)?),
            Some(Assignment::Blocks(blocks)) => (None, writer.video_in_blocks(source, blocks)?),
            Some(Assignment::Excluded(_)) | None => {
                writer.video(source, Split::Train, SplitBy::Share)?.finish(None)?;
                return Ok(());
            }
        };
        match self {
            Self::Take(found) => {
                let TakeOutcome::Accepted(accepted) =
                    ImportedTake::read(found, &plan.limits, &plan.about.speaker)?.outcome
                else {
                    anyhow::bail!("{} changed while it was imported", found.motion.display());
                };
                entry.push(&accepted.sample, 0.0)?;
            }
            Self::ShardVideo(video) => {
                for shard_sample in &video.samples {
                    let (sample, json) = shard_sample.read()?;
                    let split = whole.or(shard_sample.split()).unwrap_or(Split::Train);
                    entry.push_with_json(split, &sample, json)?;
                }
            }
            Self::Part(..) | Self::Unknown(..) => {}
        }
        entry.finish(inspected.sound.clone())?;
        Ok(())
    }
}

fn inspect_take(found: &TakeFiles, plan: &ImportPlan) -> Result<InspectedItem> {
    let take = ImportedTake::read(found, &plan.limits, &plan.about.speaker)?;
    let n_transcripts = match &take.outcome {
        TakeOutcome::Accepted(accepted) => accepted.n_transcripts,
        TakeOutcome::Rejected(_) => 1,
    };
    let duration_secs = plan.limits.fps.secs(take.n_frames);
    let mut source = VideoSource {
        name: take.name,
        file: file_name(&found.motion),
        content: take.content,
        inputs_hash: inputs_hash(found, n_transcripts, plan)?,
        ledger: Ledger { duration_secs, ..Ledger::default() },
        ..VideoSource::default()
    };
    match take.outcome {
        TakeOutcome::Rejected(rejection) => {
            source.ledger.rejected.push(RejectedInterval::with_message(
                0.0,
                duration_secs,
                rejection.why,
                rejection.message,
            ));
            Ok(InspectedItem { source, ..InspectedItem::default() })
        }
        TakeOutcome::Accepted(accepted) => {
            let n_frames = accepted.sample.n_frames();
            let end_secs = plan.limits.fps.secs(n_frames);
            source.ledger.accepted.push(AcceptedInterval { start_secs: 0.0, end_secs });
            if end_secs < duration_secs {
                let why = FrameRejection::new(Rejection::NoSoundFile, 0.0, 0.0);
                source.ledger.rejected.push(RejectedInterval::new(end_secs, duration_secs, why));
            }
            source.bones = VideoBones { lengths_metres: accepted.lengths.map(f64::from).to_vec(), n_frames };
            let bones = match accepted.moved_mm {
                moved_mm if moved_mm > NOTABLE_SHIFT_MM => Some(format!(
                    "bone lengths vary: making them constant moved the joints by {} mm (median)",
                    number(moved_mm)
                )),
                _ => None,
            };
            source.ledger.words = accepted.words;
            let of_file = accepted.sample.meta["imported"].as_object().map(bvh::notes).unwrap_or_default();
            let notes = accepted.sound_note.into_iter().chain(accepted.notes);
            let note = of_file.into_iter().chain(bones).chain(notes).collect::<Vec<_>>().join("; ");
            let mut fingerprinter = Fingerprinter::default();
            fingerprinter.push(&accepted.sample.sound.samples);
            let codes = (!plan.limits.no_sound).then(|| fingerprinter.finish());
            let split = found.genea.as_ref().map(|genea| Assignment::In(genea.split, SplitBy::Name));
            Ok(InspectedItem { source, split, codes, note, ..InspectedItem::default() })
        }
    }
}

/// Hash of the settings and files that determine the sample, with the first `n_transcripts` transcripts.
fn inputs_hash(found: &TakeFiles, n_transcripts: usize, plan: &ImportPlan) -> Result<String> {
    let described = Some(path_of(&found.motion)).filter(|path| path.is_file());
    let mut hashes = vec![hash_file(&found.motion)?];
    hashes.extend(found.sound.as_deref().map(hash_file).transpose()?);
    // An unreadable transcript costs no take.
    hashes.extend(found.transcripts.iter().take(n_transcripts).map(|path| hash_file(path).unwrap_or_default()));
    hashes.extend(described.as_deref().map(hash_file).transpose()?);
    let mut all = serde_json::json!([
        env!("CARGO_PKG_VERSION"),
        hashes,
        plan.limits.fps,
        plan.dataset.max_mb,
        plan.limits.no_sound
    ]);
    if let (Some(unit), Some(all)) = (plan.limits.units, all.as_array_mut()) {
        all.push(unit.name.into());
    }
    if let (Some(genea), Some(all)) = (&found.genea, all.as_array_mut()) {
        let sound = genea.interlocutor.as_deref().map(hash_file).transpose()?;
        all.push(serde_json::json!([genea.speaker, sound]));
    }
    Ok(blake3::hash(all.to_string().as_bytes()).to_hex().to_string())
}

fn inspect_entry(dir: &Path, name: &str, plan: &ImportPlan) -> Result<InspectedItem> {
    let info: DatasetInfo = read_json(&dir.join(INFO))?;
    let fps = plan.limits.fps;
    ensure!(
        info.fps == fps,
        "{} has {}, the dataset {fps}: set --fps to the rate of the source",
        dir.display(),
        info.fps
    );
    entry::check_name(name)?;
    let entry = VideoEntry::read(&VideoEntry::path(dir, name))?;
    ensure!(
        entry.is_intact(dir, &entry::stated_hashes(dir)),
        "{name}: its files do not match their checksums; `orator dataset verify` lists them"
    );
    let codes = entry.codes(dir)?;
    let split = match entry.split {
        Some(split) => Some(Assignment::In(split, entry.split_by.clone())),
        None => Some(Assignment::Blocks(entry.blocks.clone())).filter(|_| !entry.samples.is_empty()),
    };
    let VideoEntry { name, file, content, inputs_hash, ledger, bones, failure, .. } = entry;
    let source = VideoSource { name: name.to_string(), file, content, inputs_hash, ledger, bones, failure };
    Ok(InspectedItem {
        source,
        split,
        codes: Some(codes).filter(|codes| !codes.is_empty()),
        ..InspectedItem::default()
    })
}

fn inspect_shard_video(video: &ShardVideo, plan: &ImportPlan) -> Result<InspectedItem> {
    entry::check_name(&video.name)?;
    let fps = plan.limits.fps;
    let (mut spans, mut bone_sets, mut fingerprinter) =
        (Vec::<(f64, f64)>::new(), Vec::new(), Fingerprinter::default());
    let mut blocks: Vec<TimeBlock> = Vec::new();
    let mut content = String::new();
    let mut words: Option<TranscriptReport> = None;
    for shard_sample in &video.samples {
        let (sample, _) = shard_sample.read()?;
        let (key, own_fps) = (&sample.key, sample.motion.fps);
        ensure!(own_fps == fps, "{key} has {own_fps}, the dataset {fps}: set --fps to the rate of the source");
        let n_frames = sample.n_frames();
        let start = sample.meta["start_secs"].as_f64().unwrap_or(0.0);
        let start_secs = spans.last().map_or(start, |(before, secs)| start.max(before + secs));
        let end_secs = start_secs + fps.secs(n_frames);
        blocks.push(TimeBlock { split: shard_sample.split().or(Some(Split::Train)), start_secs, end_secs });
        spans.push((start, fps.secs(n_frames)));
        bone_sets.push(VideoBones { lengths_metres: bones::measure(&sample.motion).map(f64::from).to_vec(), n_frames });
        fingerprinter.push(&sample.sound.samples);
        if let Some(sample_words) = &sample.words {
            let count =
                WordCount { n_words: sample_words.len(), n_accepted: sample_words.len(), ..WordCount::default() };
            words.get_or_insert_default().count += count;
        }
        if let Some(hash) = sample.meta["content"].as_str() {
            content = hash.to_owned();
        }
    }
    let source = VideoSource {
        name: video.name.clone(),
        file: video.name.clone(),
        content,
        ledger: Ledger { words, ..shards::ledger(&spans) },
        bones: VideoBones {
            lengths_metres: of_speaker(&bone_sets).map(f64::from).to_vec(),
            n_frames: bone_sets.iter().map(|bones| bones.n_frames).sum(),
        },
        ..VideoSource::default()
    };
    let mut named_splits: Vec<Option<Split>> = video.samples.iter().map(ShardSample::split).collect();
    named_splits.sort();
    named_splits.dedup();
    let split = match named_splits.as_slice() {
        [] | [None] => None,
        [Some(split)] | [None, Some(split)] => Some(Assignment::In(*split, SplitBy::Name)),
        _ => Some(Assignment::Blocks(blocks)),
    };
    Ok(InspectedItem { source, split, codes: Some(fingerprinter.finish()), ..InspectedItem::default() })
}

impl InspectedItem {
    /// Whether the item has a sample to write.
    pub fn is_accepted(&self) -> bool {
        !self.source.ledger.accepted.is_empty() && self.source.failure.is_none()
    }

    /// Rejects an item whose name another item already has.
    pub fn reject_duplicate_name(mut self) -> Self {
        let message = format!("{} is there already", self.source.name);
        self.reject(self.source.ledger.accepted_secs(), 0.0, &message);
        self
    }

    /// Replaces a name that is already in use by one derived from it and the number `nth`.
    pub fn rename(&mut self, nth: usize) {
        let first = &self.source.name;
        let mark = blake3::hash(format!("{first} {nth}").as_bytes()).to_hex();
        let stem = first.rsplit_once('-').map_or(first.as_str(), |(stem, _)| stem);
        self.source.name = format!("{stem}-{}", &mark[..8]);
    }

    /// Rejects an item that shares sound with videos in different splits.
    pub fn reject_shared(&mut self, with: &[SharedSound], threshold: f64) {
        let name = self.source.name.clone();
        let others: Vec<&str> = with.iter().filter_map(|shared| shared.other(&name)).collect();
        let secs = with.first().map_or(0.0, |shared| shared.secs);
        let message =
            format!("the same {secs:.1} s of sound are in {}, which are in different splits", others.join(" and "));
        self.reject(secs, threshold, &message);
        (self.sound, self.split) = (None, None);
    }

    fn reject(&mut self, measured: f64, threshold: f64, message: &str) {
        let ledger = &mut self.source.ledger;
        let why = FrameRejection::new(Rejection::Duplicate, measured, threshold);
        let to_refused = |accepted: AcceptedInterval| {
            RejectedInterval::with_message(accepted.start_secs, accepted.end_secs, why, message.to_owned())
        };
        let all_refused: Vec<RejectedInterval> = ledger.accepted.drain(..).map(to_refused).collect();
        ledger.rejected.extend(all_refused);
        ledger.rejected.sort_by(|a, b| a.start_secs.total_cmp(&b.start_secs));
        self.codes = None;
    }

    pub fn line(&self, file: &str) -> ImportOutcome {
        let (outcome, reason, message) = match (&self.source.failure, self.source.ledger.rejected.first()) {
            (Some(error), _) => ("failed", "error".to_owned(), error.clone()),
            (None, _) if self.is_accepted() => ("kept", String::new(), self.note.clone()),
            (None, Some(rejected)) => ("refused", rejected.reason.clone(), rejected.message.clone()),
            (None, None) => ("refused", "empty".to_owned(), "it is empty".to_owned()),
        };
        ImportOutcome {
            file: file.to_owned(),
            outcome,
            accepted_secs: self.source.ledger.accepted_secs(),
            reason,
            message,
        }
    }
}
