//! Verification of a dataset. Fast: every file exists, shards have their size, the hashes of small files match, and
//! every second of every video is accounted for. Deep: the hashes of all files, and the shapes, values and bones of all
//! arrays.
//!
//! Files assembled from the videos' entries are assembled again and compared, which detects wrong numbers in any.

use super::blocks;
use super::sample::check_sample;
use crate::info::DatasetInfo;
use crate::leakage::Leakage;
use crate::read::Dataset;
use crate::write::assemble::{LedgerLine, assemble_into};
use crate::write::entry::{self, VideoEntry};
use crate::{CHECKSUMS, INFO, LEAKAGE, README, read_json};
use anyhow::{Context, Result, ensure};
use orator_base::input;
use orator_base::stage::fingerprint::hash_file;
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir::FolderLock;
use orator_base::text::counted;
use orator_base::types::time::FrameRate;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::Path;
use std::rc::Rc;

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct DatasetProblem {
    /// Path in the dataset folder.
    pub file: String,
    pub message: String,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verified {
    pub problems: Vec<DatasetProblem>,
    pub n_files: usize,
    pub n_videos: usize,
    pub n_samples: usize,
    /// Seconds of motion.
    pub secs: f64,
    pub bytes: u64,
}

impl Verified {
    fn add_problem(&mut self, file: &str, message: impl Into<String>) {
        self.problems.push(DatasetProblem { file: file.to_owned(), message: message.into() });
    }

    fn add_error(&mut self, file: &str, result: Result<()>) {
        if let Err(error) = result {
            self.add_problem(file, format!("{error:#}"));
        }
    }
}

/// Verifies the dataset in `dir`; the problems are sorted and unique.
///
/// # Errors
/// A folder that cannot be listed, is not a dataset, or is being written (`BusyFolder`).
pub fn verify(dir: &Path, deep: bool, progress: &dyn Progress) -> Result<Verified> {
    let is_dataset = [INFO, CHECKSUMS].iter().any(|name| dir.join(name).exists());
    ensure!(is_dataset, "{} is not a dataset: it has neither {INFO} nor {CHECKSUMS}", dir.display());
    let _lock = FolderLock::shared(dir)?;
    let mut found = Verified::default();
    let present = files_of(dir)?;
    found.n_files = present.len();
    let expected = assemble_again(dir, &present, &mut found).unwrap_or_else(|error| {
        found.add_problem(INFO, format!("{error:#}"));
        BTreeMap::new()
    });
    if !expected.is_empty() {
        check_files(&present, &expected, &mut found);
        check_videos(dir, &mut found)?;
        check_hashes(dir, &expected, deep, &mut found, progress);
        if deep {
            check_samples(dir, &mut found, progress);
        }
    }
    found.problems.sort();
    found.problems.dedup();
    Ok(found)
}

/// Assembles the dataset again; returns the expected hash of every file, by path.
fn assemble_again(
    dir: &Path,
    present: &BTreeMap<String, u64>,
    found: &mut Verified,
) -> Result<BTreeMap<String, String>> {
    let info: DatasetInfo = read_json(&dir.join(INFO))?;
    let leakage: Leakage = read_json(&dir.join(LEAKAGE))?;
    let written: Rc<RefCell<Vec<u8>>> = Rc::default();
    let mut open = |name: &str| -> Result<Box<dyn Write>> {
        Ok(if name == CHECKSUMS { Box::new(SharedBuffer(written.clone())) } else { Box::new(std::io::sink()) })
    };
    assemble_into(dir, &info.about(), &leakage.compared(), &mut open)?;
    let mut text = String::from_utf8(written.borrow().clone()).context("checksums are not UTF-8")?;
    if let Some(card) = card_line(dir)
        && let Some(now) = text.lines().find(|line| is_card(line)).map(str::to_owned)
    {
        text = text.replace(&now, &card);
    }
    let expected: BTreeMap<String, String> =
        text.lines().filter_map(|line| line.split_once("  ")).map(|(hash, file)| (file.into(), hash.into())).collect();
    if present.contains_key(CHECKSUMS) {
        let stated =
            input::read(dir.join(CHECKSUMS), input::MAX_TEXT).with_context(|| format!("cannot read {CHECKSUMS}"))?;
        if stated != text.as_bytes() {
            let text_of = String::from_utf8_lossy(&stated).into_owned();
            let named = text_of.lines().filter_map(|line| line.split_once("  ")).map(|(_, file)| file);
            for file in named.filter(|file| !present.contains_key(*file)) {
                found.add_problem(file, format!("missing, but listed in {CHECKSUMS}"));
            }
            let stated: BTreeSet<&[u8]> = stated.split(|byte| *byte == b'\n').collect();
            let differing =
                text.lines().filter(|line| !stated.contains(line.as_bytes())).filter_map(|line| line.split_once("  "));
            let differing: Vec<&str> = differing.map(|(_, file)| file).collect();
            let files = if differing.is_empty() { "the format of its lines".to_owned() } else { differing.join(", ") };
            found.add_problem(CHECKSUMS, format!("differs from the files of the videos in {files}"));
        }
    }
    Ok(expected)
}

/// Line of the dataset card in the stored checksums: the text differs between versions, so its stored hash is accepted.
fn card_line(dir: &Path) -> Option<String> {
    let stated = input::read_text(dir.join(CHECKSUMS), input::MAX_TEXT).ok()?;
    let line = stated.lines().find(|line| is_card(line))?;
    let is_hash = line.split_once("  ").is_some_and(|(hash, _)| hash.len() == 64 && hash.is_ascii());
    is_hash.then(|| line.to_owned())
}

fn is_card(line: &str) -> bool {
    line.split_once("  ").is_some_and(|(_, file)| file == README)
}

/// Writer into a shared buffer.
struct SharedBuffer(Rc<RefCell<Vec<u8>>>);

impl Write for SharedBuffer {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.borrow_mut().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Checks that exactly the listed files exist.
fn check_files(present: &BTreeMap<String, u64>, expected: &BTreeMap<String, String>, found: &mut Verified) {
    for file in expected.keys().map(String::as_str).chain([CHECKSUMS]).filter(|file| !present.contains_key(*file)) {
        found.add_problem(file, "missing");
    }
    for file in present.keys().filter(|file| !expected.contains_key(*file) && *file != CHECKSUMS) {
        found.add_problem(file, "not part of the dataset");
    }
}

/// Checks the entry of each video: shards, samples, ledger, blocks, words.
fn check_videos(dir: &Path, found: &mut Verified) -> Result<()> {
    let info = read_json::<DatasetInfo>(&dir.join(INFO))?;
    let fps = info.fps;
    let mut keys = BTreeSet::new();
    for name in entry::names(dir)? {
        let file = format!("{}/{name}.json", entry::FOLDER);
        let entry = match VideoEntry::read(&VideoEntry::path(dir, &name)) {
            Ok(entry) => entry,
            Err(error) => {
                found.add_problem(&file, format!("{error:#}"));
                continue;
            }
        };
        found.n_videos += 1;
        found.n_samples += entry.samples.len();
        found.secs += fps.secs(entry.samples.iter().map(|sample| sample.n_frames).sum());
        for shard in &entry.shards {
            let bytes = std::fs::metadata(dir.join(&shard.file)).map_or(0, |meta| meta.len());
            if bytes != shard.bytes {
                found.add_problem(&shard.file, format!("{bytes} bytes, expected {}", shard.bytes));
            }
            let n_samples = entry.samples.iter().filter(|sample| sample.shard == shard.file).count();
            if n_samples != shard.n_samples {
                found
                    .add_problem(&file, format!("{n_samples} samples in {}, expected {}", shard.file, shard.n_samples));
            }
        }
        for sample in &entry.samples {
            let in_shard = entry.shards.iter().any(|shard| shard.file == sample.shard && sample.fits(shard.bytes));
            let same_split = entry.split.is_none_or(|split| split == sample.split);
            let same_split = same_split && sample.shard.starts_with(sample.split.name());
            if !in_shard || !same_split || !sample.key.starts_with(&name) || !keys.insert(sample.key.clone()) {
                found.add_problem(&file, format!("invalid key, split or shard of the sample {}", sample.key));
            }
        }
        found.add_error(&file, check_ledger(&entry, fps));
        found.add_error(&file, blocks::check_blocks(&entry, &info));
        found.add_error(&file, check_word_counts(&entry));
    }
    Ok(())
}

/// Checks that a video's ledger covers every second and its samples the accepted seconds, to within a frame per sample.
fn check_ledger(entry: &VideoEntry, fps: FrameRate) -> Result<()> {
    let ledger = &entry.ledger;
    let unknown = ledger.duration_secs == 0.0 && entry.failure.is_some();
    ensure!(ledger.is_complete() || unknown, "its ledger does not cover {:.3} s without gaps", ledger.duration_secs);
    let frames: usize = entry.samples.iter().map(|sample| sample.n_frames).sum();
    let deviation = (ledger.accepted_secs() - fps.secs(frames)).abs();
    let allowed = fps.secs(1) * entry.samples.len().max(1) as f64 + 1e-6;
    ensure!(
        deviation <= allowed && ledger.accepted.len() == entry.samples.len(),
        "its ledger accepts {:.3} s in {}, its samples have {:.3} s in {}",
        ledger.accepted_secs(),
        counted(ledger.accepted.len(), "interval"),
        fps.secs(frames),
        counted(entry.samples.len(), "sample")
    );
    Ok(())
}

/// Checks that the ledger of a video accounts for every word of its transcript.
fn check_word_counts(entry: &VideoEntry) -> Result<()> {
    let has_words = entry.samples.iter().any(|sample| sample.words.is_some());
    ensure!(entry.ledger.words.is_some() || !has_words, "its samples have words, its ledger has none");
    let is_complete = entry.ledger.words.as_ref().is_none_or(|words| words.count.is_complete());
    ensure!(is_complete, "its ledger does not account for every word of the transcript");
    Ok(())
}

/// Checks the hash of every small file, and with `deep` those of large files too.
fn check_hashes(
    dir: &Path,
    expected: &BTreeMap<String, String>,
    deep: bool,
    found: &mut Verified,
    progress: &dyn Progress,
) {
    let task = progress.begin("hashes", expected.len() as u64);
    for (file, hash) in expected {
        let is_large = [".tar", ".sound"].iter().any(|ending| file.ends_with(ending));
        let path = dir.join(file);
        // `hash_file` reports a pipe or device in the place of a large file without reading it.
        if (deep || !is_large || !path.is_file()) && path.exists() {
            found.bytes += std::fs::metadata(&path).map_or(0, |meta| meta.len());
            match hash_file(&path) {
                Ok(now) if now == *hash => {}
                Ok(_) if is_large => found.add_problem(file, "wrong hash"),
                Ok(_) => found.add_problem(file, "does not match the files of the videos"),
                Err(error) => found.add_problem(file, format!("{error:#}")),
            }
        }
        task.advance(1);
    }
}

/// Checks every array of every sample.
fn check_samples(dir: &Path, found: &mut Verified, progress: &dyn Progress) {
    let dataset = match Dataset::open(dir) {
        Ok(dataset) => dataset,
        Err(error) => return found.add_problem(INFO, format!("{error:#}")),
    };
    let task = progress.begin("samples", found.n_samples as u64);
    for name in entry::names(dir).unwrap_or_default() {
        let Ok(entry) = VideoEntry::read(&VideoEntry::path(dir, &name)) else { continue };
        let mut n_words = 0;
        for sample in &entry.samples {
            let read = dataset.read(sample).inspect(|read| n_words += read.words.as_ref().map_or(0, Vec::len));
            let checked = read.and_then(|read| check_sample(&read, &entry.bones.lengths_metres));
            found.add_error(&sample.shard, checked.with_context(|| sample.key.clone()));
            task.advance(1);
        }
        let n_accepted = entry.ledger.words.as_ref().map_or(0, |words| words.count.n_accepted);
        if n_words != n_accepted {
            let file = format!("{}/{name}.json", entry::FOLDER);
            found.add_problem(
                &file,
                format!("its ledger counts {n_accepted} words in samples, the samples contain {n_words}"),
            );
        }
    }
}

/// Paths and sizes of the files below `dir`.
fn files_of(dir: &Path) -> Result<BTreeMap<String, u64>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![(dir.to_owned(), String::new())];
    while let Some((folder, prefix)) = folders.pop() {
        let listing = || format!("cannot list the folder {}", folder.display());
        for entry in std::fs::read_dir(&folder).with_context(listing)? {
            let entry = entry.with_context(listing)?;
            let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
            let meta = entry.metadata().with_context(listing)?;
            if meta.is_dir() {
                folders.push((entry.path(), format!("{name}/")));
            } else {
                files.insert(name, meta.len());
            }
        }
    }
    Ok(files)
}

/// Reads the ledgers of all videos of the dataset in `dir`.
pub fn read_ledgers(dir: &Path) -> Result<Vec<LedgerLine>> {
    let path = dir.join(crate::LEDGER);
    let text = input::read_text(&path, input::MAX_TEXT).with_context(|| format!("reading {}", path.display()))?;
    let parse = |line: &str| serde_json::from_str(line).with_context(|| format!("{} is damaged", path.display()));
    text.lines().map(parse).collect()
}
