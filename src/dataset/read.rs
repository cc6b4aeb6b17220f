//! Reading of a dataset folder: any sample, or any range of frames of a sample. Errors for damaged, missing or foreign
//! files name the file and what to do.

use super::bones::check_lengths;
use super::index::{ByteRange, SampleRef};
use super::info::DatasetInfo;
use super::sample::{N_KEYPOINTS, Sample, WORDS_EXTENSION};
use super::split::Split;
use super::stats::DatasetStats;
use super::{CHECKSUMS, INDEX, INFO, STATS, read_json};
use anyhow::{Context, Result, ensure};
use ndarray::{Array2, Array3};
use orator_base::input;
use orator_base::stage::workdir::FolderLock;
use orator_base::types::file_name::FileName;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::sound::{SAMPLE_RATE, Sound};
use orator_formats::npy::{self, Element, Layout};
use orator_formats::transcript::Word;
use orator_formats::wav;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs::{self, File};
use std::io::BufRead;
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Open dataset; threads may share a reference without further locking.
pub struct Dataset {
    dir: PathBuf,
    info: DatasetInfo,
    stats: DatasetStats,
    samples: Vec<SampleRef>,
    shards: ShardFiles,
    /// Shared lock: the folder is not replaced and its videos are not forgotten while it is held.
    _lock: FolderLock,
}

impl Dataset {
    /// Opens the folder of one speaker (`work/dataset/<speaker>`): reads its JSON files and checks that every shard
    /// exists and has the recorded size. Contents are checked by `read` and `verify`. Others cannot write it meanwhile.
    ///
    /// # Errors
    /// A folder that is not a dataset, is damaged, or is being written (`BusyFolder`).
    pub fn open(dir: impl AsRef<Path>) -> Result<Dataset> {
        let dir = dir.as_ref().to_owned();
        let lock = FolderLock::shared(&dir)?;
        ensure!(
            dir.join(INFO).is_file(),
            "{} is not a dataset: it has no {}; `orator run` creates one in work/dataset/SPEAKER",
            dir.display(),
            INFO
        );
        let schema: Schema = read_json(&dir.join(INFO))?;
        ensure!(
            schema.schema == super::SCHEMA,
            "{} has layout version {}, this program reads {}: run the dataset stage again",
            dir.display(),
            schema.schema,
            super::SCHEMA
        );
        let info: DatasetInfo = read_json(&dir.join(INFO))?;
        ensure!(
            info.sound_rate == SAMPLE_RATE && info.fps.is_plausible() && info.joints.len() == N_JOINTS,
            "{}: expected audio at {SAMPLE_RATE} Hz, 1 to 1000 frames per second and {N_JOINTS} joints",
            dir.join(INFO).display()
        );
        check_lengths("bone_lengths_metres", &info.bone_lengths_metres)
            .with_context(|| dir.join(INFO).display().to_string())?;
        let stats: DatasetStats = read_json(&dir.join(STATS))?;
        stats.check().with_context(|| dir.join(STATS).display().to_string())?;
        let mut shards = BTreeMap::new();
        for shard in info.shards() {
            let path = dir.join(&shard.file);
            let bytes = fs::metadata(&path).with_context(|| format!("cannot read the shard {}", path.display()))?.len();
            ensure!(
                bytes == shard.bytes,
                "{} has {bytes} bytes, expected {}: the file is damaged; run the dataset stage again with --force",
                path.display(),
                shard.bytes
            );
            shards.insert(shard.file.clone(), bytes);
        }
        let samples = read_index(&dir.join(INDEX))?;
        for sample in &samples {
            let fits = shards.get(&sample.shard).is_some_and(|bytes| sample.fits(*bytes));
            ensure!(fits, "{}: {} is outside its shard", dir.join(INDEX).display(), sample.key);
        }
        let n_samples: usize = info.splits.values().map(|split| split.samples).sum();
        ensure!(
            samples.len() == n_samples,
            "{} has {} samples, {} lists {n_samples}: the file is damaged; run the dataset stage again with --force",
            dir.join(INDEX).display(),
            samples.len(),
            dir.join(INFO).display()
        );
        let shards = ShardFiles::new(&dir, shards.into_keys().collect());
        Ok(Dataset { dir, info, stats, samples, shards, _lock: lock })
    }

    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// BLAKE3 (hexadecimal) of `checksums.b3`, which identifies the contents of all files.
    ///
    /// # Errors
    /// An unreadable `checksums.b3`.
    pub fn hash(&self) -> Result<String> {
        let path = self.dir.join(CHECKSUMS);
        let checksums =
            input::read(&path, input::MAX_TEXT).with_context(|| format!("cannot read {}", path.display()))?;
        Ok(blake3::hash(&checksums).to_hex().to_string())
    }

    /// Contents of `info.json`.
    pub fn info(&self) -> &DatasetInfo {
        &self.info
    }

    /// Contents of `stats.json`.
    pub fn stats(&self) -> &DatasetStats {
        &self.stats
    }

    /// Samples of a split, in index order.
    pub fn samples(&self, split: Split) -> Vec<SampleRef> {
        self.samples.iter().filter(|sample| sample.split == split).cloned().collect()
    }

    /// Reads a sample and checks its hash.
    ///
    /// # Errors
    /// An unreadable or damaged sample; the message names it and its shard.
    pub fn read(&self, sample: &SampleRef) -> Result<Sample> {
        let hash = blake3::hash(&self.bytes(sample, ByteRange { offset: sample.offset, size: sample.size })?);
        ensure!(
            hash.to_hex().as_str() == sample.blake3,
            "{}: the sample {} is damaged (its hash differs): run the dataset stage again with --force",
            self.dir.join(&sample.shard).display(),
            sample.key
        );
        let meta = serde_json::from_slice(&self.bytes(sample, sample.json)?)
            .with_context(|| format!("cannot read {}.json in {}", sample.key, sample.shard))?;
        let frames = 0..sample.n_frames;
        let pose2d = npy::floats(&self.rows(sample, sample.pose2d, Element::F32, &[N_KEYPOINTS, 3], frames.clone())?);
        let pose2d =
            Array3::from_shape_vec((frames.len(), N_KEYPOINTS, 3), pose2d).context("invalid number of keypoints")?;
        let sound = self.sound(sample, 0..sample.n_sound_samples())?;
        let of_interlocutor = sample.interlocutor.map(|wav| SampleRef { wav, ..sample.clone() });
        let interlocutor = of_interlocutor.map(|other| self.sound(&other, 0..other.n_sound_samples())).transpose()?;
        let posture = self.posture(sample, frames.clone())?;
        let (key, words) = (sample.key.to_string(), self.words(sample)?);
        let motion = self.motion(sample, frames)?;
        Ok(Sample { key, motion, pose2d, sound, words, posture, interlocutor, meta })
    }

    /// Reads the words of a sample; `None`: no transcripts were requested.
    pub fn words(&self, sample: &SampleRef) -> Result<Option<Vec<Word>>> {
        let Some(range) = sample.words else { return Ok(None) };
        let words = serde_json::from_slice(&self.bytes(sample, range)?);
        words.with_context(|| format!("cannot read {}.{WORDS_EXTENSION} in {}", sample.key, sample.shard))
    }

    /// Reads the posture of frames of a sample, without checking the hash. `None`: the sample has no posture.
    pub fn posture(&self, sample: &SampleRef, frames: Range<usize>) -> Result<Option<Posture>> {
        let (Some(head), Some(trunk)) = (sample.head, sample.trunk) else { return Ok(None) };
        let angles = |range: ByteRange| -> Result<Array2<f32>> {
            let bytes = self.rows(sample, range, Element::F32, &[3], frames.clone())?;
            Array2::from_shape_vec((frames.len(), 3), npy::floats(&bytes)).context("invalid number of angles")
        };
        Ok(Some(Posture { head: angles(head)?, trunk: angles(trunk)? }))
    }

    /// Reads the motion of a range of frames of a sample, without checking the hash.
    pub fn motion(&self, sample: &SampleRef, frames: Range<usize>) -> Result<Motion> {
        let n_frames = frames.len();
        let joints = npy::floats(&self.rows(sample, sample.pose3d, Element::F32, &[N_JOINTS, 3], frames.clone())?);
        let mask = npy::bools(&self.rows(sample, sample.mask, Element::Bool, &[N_JOINTS], frames)?);
        let motion = Motion {
            fps: self.info.fps,
            joints: Array3::from_shape_vec((n_frames, N_JOINTS, 3), joints).context("invalid number of joints")?,
            mask: Array2::from_shape_vec((n_frames, N_JOINTS), mask).context("invalid size of the mask")?,
        };
        motion.in_range().with_context(|| format!("{} in {}", sample.key, self.dir.join(&sample.shard).display()))
    }

    /// Reads a range of audio samples of a sample, without checking the hash.
    pub fn sound(&self, sample: &SampleRef, range: Range<usize>) -> Result<Sound> {
        let location = || format!("cannot read {}.wav in {}", sample.key, self.dir.join(&sample.shard).display());
        let (rate, at) = (self.info.sound_rate, sample.wav.offset + wav::HEADER_BYTES as u64);
        let head = ByteRange { offset: sample.wav.offset, size: sample.wav.size.min(wav::HEADER_BYTES as u64) };
        let n_samples = wav::n_samples(&self.bytes(sample, head)?, sample.wav.size, rate).with_context(location)?;
        ensure!(range.end <= n_samples, "{}: it has {n_samples} samples, {} were requested", location(), range.end);
        let span = ByteRange { offset: at + 2 * range.start as u64, size: 2 * range.len() as u64 };
        Ok(Sound { rate, samples: wav::samples(&self.bytes(sample, span)?) })
    }

    /// Reads the bytes of the rows `frames` of an array.
    fn rows(
        &self,
        sample: &SampleRef,
        span: ByteRange,
        element: Element,
        row: &[usize],
        frames: Range<usize>,
    ) -> Result<Vec<u8>> {
        let location =
            || format!("cannot read an array of {} in {}", sample.key, self.dir.join(&sample.shard).display());
        let head = ByteRange { offset: span.offset, size: span.size.min(npy::HEADER_BYTES as u64) };
        let layout = Layout::parse(&self.bytes(sample, head)?, span.size, element, row).with_context(location)?;
        ensure!(
            frames.start <= frames.end && frames.end <= layout.n_rows,
            "{}: it has {} frames, {}..{} were requested",
            location(),
            layout.n_rows,
            frames.start,
            frames.end
        );
        let offset = span.offset + (layout.data_at + frames.start * layout.row_bytes) as u64;
        self.bytes(sample, ByteRange { offset, size: (frames.len() * layout.row_bytes) as u64 })
    }

    fn bytes(&self, sample: &SampleRef, span: ByteRange) -> Result<Vec<u8>> {
        let location = || format!("cannot read {} in {}", sample.key, self.dir.join(&sample.shard).display());
        let file = self.shards.get(&sample.shard).with_context(location)?;
        // The size of a sample is bounded by its shard (checked by `open`), which bounds the allocation.
        ensure!(
            span.size <= sample.size,
            "{}: {} bytes were requested, more than the sample has",
            location(),
            span.size
        );
        let mut bytes = vec![0; span.size as usize];
        file.read_exact_at(&mut bytes, span.offset).with_context(location)?;
        Ok(bytes)
    }
}

fn read_index(path: &Path) -> Result<Vec<SampleRef>> {
    let reading = || format!("cannot read {}", path.display());
    let lines = std::io::BufReader::new(input::open(path).with_context(reading)?).lines();
    let parse = |(n, line): (usize, std::io::Result<String>)| {
        let wrong = || format!("{}, line {}: invalid entry; run the dataset stage again", path.display(), n + 1);
        serde_json::from_str(&line.with_context(reading)?).with_context(wrong)
    };
    lines.enumerate().map(parse).collect()
}

#[derive(serde::Deserialize)]
struct Schema {
    schema: u32,
}

/// Maximum number of files held open; the usual limit of a process is 1,024.
const MAX_OPEN: usize = 256;

/// Cache of open shard files of a folder, shared by threads.
pub struct ShardFiles {
    dir: PathBuf,
    names: BTreeSet<FileName>,
    /// Open files, the most recently used first.
    open: Mutex<VecDeque<(FileName, Arc<File>)>>,
}

impl ShardFiles {
    /// Cache for the shards `names` in `dir`; no file is opened yet.
    pub fn new(dir: &Path, names: BTreeSet<FileName>) -> Self {
        Self { dir: dir.to_owned(), names, open: Mutex::default() }
    }

    /// Returns the file of a shard, opening it if necessary.
    ///
    /// # Errors
    /// A name that is not one of the shards; a file that cannot be opened.
    pub fn get(&self, name: &FileName) -> Result<Arc<File>> {
        self.names.get(name).context("unknown shard")?;
        let mut open = self.open.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let used = match open.iter().position(|(known, _)| known == name) {
            Some(at) => open.remove(at),
            None => None,
        };
        let used = match used {
            Some(used) => used,
            None => {
                let path = self.dir.join(name);
                let file = input::open(&path).with_context(|| format!("cannot open the shard {}", path.display()))?;
                (name.clone(), Arc::new(file))
            }
        };
        let file = used.1.clone();
        open.push_front(used);
        open.truncate(MAX_OPEN);
        Ok(file)
    }
}
