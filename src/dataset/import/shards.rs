//! Tar shards outside a dataset folder. Members are found by name, in any order and in any tar; other files are skipped
//! with a note. The bytes of members are kept unchanged wherever the dataset format allows it.

use crate::sample::{EXTENSIONS, N_KEYPOINTS, OPTIONAL_EXTENSIONS, Sample, WORDS_EXTENSION};
use crate::{Split, file_name};
use anyhow::{Context, Result, bail, ensure};
use ndarray::{Array2, Array3};
use orator_base::input;
use orator_base::stage::ledger::{AcceptedInterval, Ledger, RejectedInterval};
use orator_base::stage::rejection::{FrameRejection, Rejection};
use orator_base::text::counted;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::sound::{SAMPLE_RATE, Sound};
use orator_base::types::time::FrameRate;
use orator_formats::npy::{self, Element, Layout};
use orator_formats::wav;
use std::collections::BTreeMap;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

#[derive(Clone, Debug, PartialEq, Eq)]
struct MemberLocation {
    tar: PathBuf,
    offset: u64,
    bytes: u64,
}

/// Sample not yet read; members are in the order of `EXTENSIONS`, optional ones in that of `OPTIONAL_EXTENSIONS`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShardSample {
    pub key: String,
    members: [Option<MemberLocation>; 5],
    optional: [Option<MemberLocation>; OPTIONAL_EXTENSIONS.len()],
}

/// Samples whose keys differ only after the last dash.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShardVideo {
    pub name: String,
    /// Samples sorted by key.
    pub samples: Vec<ShardSample>,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ShardTars {
    pub videos: Vec<ShardVideo>,
    /// Notes on skipped files, a sentence each.
    pub notes: Vec<String>,
    /// Unreadable tars, with the error.
    pub failed: Vec<(PathBuf, String)>,
}

impl ShardVideo {
    /// Tar files that hold the samples of this video.
    pub fn tars(&self) -> Vec<&PathBuf> {
        let members = self.samples.iter().flat_map(|sample| sample.members.iter().chain(&sample.optional));
        members.flatten().map(|location| &location.tar).collect()
    }
}

/// Lists the tar files; members are read only to compare two with the same name.
pub fn open(tars: &[PathBuf]) -> ShardTars {
    let mut found = ShardTars::default();
    let mut samples: BTreeMap<String, ShardSample> = BTreeMap::new();
    for tar in tars {
        let mut unknown = BTreeMap::<String, usize>::new();
        match list(tar, &mut samples, &mut unknown) {
            Ok(0) => found.failed.push((tar.clone(), "it contains no files".to_owned())),
            Ok(_) => {}
            Err(error) => found.failed.push((tar.clone(), format!("{error:#}"))),
        }
        let name = file_name(tar);
        let left_out = |(ending, n): (String, usize)| {
            format!("{name}: skipped {} not in a sample", counted(n, &format!(".{ending} file")))
        };
        found.notes.extend(unknown.into_iter().map(left_out));
    }
    let mut videos: BTreeMap<String, ShardVideo> = BTreeMap::new();
    for (key, sample) in samples {
        let name = key.rsplit_once('-').map_or(key.as_str(), |(video, _)| video).to_owned();
        let video = videos.entry(name.clone()).or_insert(ShardVideo { name, samples: Vec::new() });
        video.samples.push(sample);
    }
    found.videos = videos.into_values().collect();
    found
}

/// Adds a tar's members to `samples`, and counts files of other extensions in `unknown`. Returns the number of files.
fn list(
    tar: &Path,
    samples: &mut BTreeMap<String, ShardSample>,
    unknown: &mut BTreeMap<String, usize>,
) -> Result<usize> {
    let mut n_files = 0;
    let reading = || format!("cannot read {} as a tar file", tar.display());
    let file = input::open(tar).with_context(reading)?;
    let length = file.metadata().with_context(reading)?.len();
    let mut archive = tar::Archive::new(file);
    for entry in archive.entries_with_seek().with_context(reading)? {
        let entry = entry.with_context(reading)?;
        if !entry.header().entry_type().is_file() {
            continue;
        }
        n_files += 1;
        let path = entry.path().with_context(reading)?.into_owned();
        let name = file_name(&path);
        let (key, ending) = name.split_once('.').unwrap_or((&name, ""));
        let member = EXTENSIONS.iter().chain(&OPTIONAL_EXTENSIONS).position(|extension| *extension == ending);
        let Some(member) = member else {
            *unknown.entry(ending.to_owned()).or_default() += 1;
            continue;
        };
        let location = MemberLocation { tar: tar.to_owned(), offset: entry.raw_file_position(), bytes: entry.size() };
        ensure!(location.offset.saturating_add(location.bytes) <= length, "{}: {name} is truncated", reading());
        let new_sample =
            || ShardSample { key: key.to_owned(), members: [const { None }; 5], optional: [const { None }; 4] };
        let sample = samples.entry(key.to_owned()).or_insert_with(new_sample);
        let Some(known) = sample.members.iter_mut().chain(&mut sample.optional).nth(member) else { continue };
        if let Some(first) = known {
            let is_equal = read_member(first)? == read_member(&location)?;
            ensure!(is_equal, "{name} differs between {} and {}", first.tar.display(), tar.display());
        }
        known.get_or_insert(location);
    }
    Ok(n_files)
}

/// Split in the name of a tar file (`train-...tar`).
fn split_of(tar: &Path) -> Option<Split> {
    let name = tar.file_name()?.to_string_lossy().into_owned();
    Split::ALL.into_iter().find(|split| name.starts_with(&format!("{}-", split.name())))
}

fn read_member(location: &MemberLocation) -> Result<Vec<u8>> {
    let read = || -> std::io::Result<Vec<u8>> {
        let mut file = input::open(&location.tar)?;
        file.seek(SeekFrom::Start(location.offset))?;
        let mut bytes = Vec::new();
        file.take(location.bytes).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    read().with_context(|| format!("cannot read {}", location.tar.display()))
}

impl ShardSample {
    /// Split in the name of a tar file of the sample; `None`: no name states one.
    pub fn split(&self) -> Option<Split> {
        self.members.iter().flatten().find_map(|location| split_of(&location.tar))
    }

    /// Reads the sample, and the unchanged bytes of its JSON.
    ///
    /// # Errors
    /// A missing or damaged member; the message names the member and its tar file.
    pub fn read(&self) -> Result<(Sample, Vec<u8>)> {
        let mut members = [const { Vec::new() }; 5];
        let mut tar = String::new();
        for ((location, extension), bytes) in self.members.iter().zip(EXTENSIONS).zip(&mut members) {
            let Some(location) = location else { bail!("the sample {} has no {}.{extension}", self.key, self.key) };
            tar = location.tar.display().to_string();
            *bytes = read_member(location)?;
        }
        let [json, mask, pose2d, pose3d, sound] = &members;
        let [words, head, trunk, interlocutor] = &self.optional;
        let sample = || -> Result<Sample> {
            let words = words.as_ref().map(read_member).transpose()?;
            let words = words.map(|bytes| serde_json::from_slice(&bytes).context(WORDS_EXTENSION)).transpose()?;
            let posture = match (head, trunk) {
                (Some(head), Some(trunk)) => Some(Posture { head: angles(head)?, trunk: angles(trunk)? }),
                (None, None) => None,
                _ => bail!("it has one of head.npy and trunk.npy: expected both or none"),
            };
            let interlocutor = interlocutor.as_ref().map(|location| read_wav(&read_member(location)?)).transpose();
            let interlocutor = interlocutor.context(OPTIONAL_EXTENSIONS[3])?;
            let sample = Sample { words, posture, interlocutor, ..self.parse(json, mask, pose2d, pose3d, sound)? };
            sample.optional_members()?;
            Ok(sample)
        };
        let sample = sample().with_context(|| format!("the sample {} in {tar} is damaged", self.key))?;
        Ok((sample, members.into_iter().next().unwrap_or_default()))
    }

    fn parse(&self, json: &[u8], mask: &[u8], pose2d: &[u8], pose3d: &[u8], sound: &[u8]) -> Result<Sample> {
        let meta: serde_json::Value = serde_json::from_slice(json).context("json")?;
        let fps: FrameRate = serde_json::from_value(meta["fps"].clone()).context("json: fps")?;
        let rows = |bytes: &[u8], element: Element, row: &[usize]| -> Result<(usize, usize)> {
            let layout = Layout::parse(bytes, bytes.len() as u64, element, row)?;
            Ok((layout.n_rows, layout.data_at))
        };
        let (n_frames, at) = rows(pose3d, Element::F32, &[N_JOINTS, 3]).context("pose3d.npy")?;
        let joints =
            Array3::from_shape_vec((n_frames, N_JOINTS, 3), npy::floats(&pose3d[at..])).context("pose3d.npy")?;
        let (n_rows, at) = rows(mask, Element::Bool, &[N_JOINTS]).context("mask.npy")?;
        let mask = Array2::from_shape_vec((n_rows, N_JOINTS), npy::bools(&mask[at..])).context("mask.npy")?;
        let (n_rows, at) = rows(pose2d, Element::F32, &[N_KEYPOINTS, 3]).context("pose2d.npy")?;
        let pose2d =
            Array3::from_shape_vec((n_rows, N_KEYPOINTS, 3), npy::floats(&pose2d[at..])).context("pose2d.npy")?;
        let sound = read_wav(sound).context("wav")?;
        fps.checked().context("json: fps")?;
        let motion = Motion { fps, joints, mask }.in_range().context("pose3d.npy")?;
        let (key, words, posture, interlocutor) = (self.key.clone(), None, None, None);
        let sample = Sample { key, motion, pose2d, sound, words, posture, interlocutor, meta };
        sample.members()?;
        Ok(sample)
    }
}

/// Reads the angles of head or trunk, [T, 3], radians.
fn angles(location: &MemberLocation) -> Result<Array2<f32>> {
    let bytes = read_member(location)?;
    let layout = Layout::parse(&bytes, bytes.len() as u64, Element::F32, &[3]).context("head.npy or trunk.npy")?;
    Array2::from_shape_vec((layout.n_rows, 3), npy::floats(&bytes[layout.data_at..]))
        .context("invalid number of angles")
}

/// Reads a 16-bit mono wav at `SAMPLE_RATE`, with a header of any length.
fn read_wav(bytes: &[u8]) -> Result<Sound> {
    if wav::n_samples(bytes, bytes.len() as u64, SAMPLE_RATE).is_ok() {
        return Ok(Sound { rate: SAMPLE_RATE, samples: wav::samples(&bytes[wav::HEADER_BYTES..]) });
    }
    let reader = hound::WavReader::new(bytes)?;
    let spec = reader.spec();
    ensure!(
        (spec.sample_rate, spec.channels, spec.bits_per_sample) == (SAMPLE_RATE, 1, 16),
        "{} Hz, {} channels, {} bits; expected 16-bit mono at {SAMPLE_RATE} Hz",
        spec.sample_rate,
        spec.channels,
        spec.bits_per_sample
    );
    let samples: Result<Vec<f32>, _> = reader.into_samples::<i16>().map(|s| Ok(f32::from(s?) / 32_768.0)).collect();
    samples.map(|samples| Sound { rate: SAMPLE_RATE, samples }).map_err(|error: hound::Error| error.into())
}

/// Ledger of a video that is known from its samples alone, each as (start, duration) in seconds; the gaps between them
/// are rejected as not imported.
pub fn ledger(samples: &[(f64, f64)]) -> Ledger {
    let mut ledger = Ledger::default();
    for &(start, secs) in samples {
        let at = ledger.duration_secs;
        let start_secs = if start.is_finite() && start > at { start } else { at };
        if start_secs > at {
            let why = FrameRejection::new(Rejection::NotImported, 0.0, 0.0);
            ledger.rejected.push(RejectedInterval::new(at, start_secs, why));
        }
        ledger.duration_secs = start_secs + secs;
        ledger.accepted.push(AcceptedInterval { start_secs, end_secs: ledger.duration_secs });
    }
    ledger
}
