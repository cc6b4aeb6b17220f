//! Builds a study folder from a study file: clips, motion, films, plan and key, and last the seal. An interrupted build
//! reuses the films that are complete. Output is deterministic for any number of workers. All films have equal size, so
//! that it does not reveal the condition: an mp4 is padded with a `free` box at its end, which players skip.

use super::design::{ClipNeeds, design};
use super::file::{StudyFile, StudySpeaker};
use super::folder::{StudyFolder, read_json, write_json};
use super::plan::{FilmContent, StudyKey, StudyPlan};
use super::preregistration::Preregistration;
use super::seal::StudySeal;
use super::stimuli::cut::{RejectedSegment, StudyClip};
use super::stimuli::film::{check_encoder, film_name};
use super::stimuli::filmed_speaker::{CutSpeaker, FilmedSpeaker, normalise_loudness};
use anyhow::{Context, Result, ensure};
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir::{self, lock, write_file};
use orator_formats::wav;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

#[derive(Clone, Debug, Serialize)]
pub struct BuiltStudy {
    pub folder: PathBuf,
    /// Combined hash of the seal.
    pub seal: String,
    pub up_to_date: bool,
    pub n_sessions: usize,
    pub n_trials: usize,
    pub n_films: usize,
    /// Size of each film, bytes.
    pub film_bytes: u64,
    /// Loudness of the films, LUFS.
    pub loudness_lufs: f64,
    /// Balance of votes, one sentence per task; empty if the study had been built before.
    pub balance: Vec<String>,
    pub speakers: Vec<BuiltSpeaker>,
}

/// File that describes the clips, in the folder of their audio.
const CLIPS_FILE: &str = "clips.json";

#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct BuiltSpeaker {
    pub name: String,
    pub clips: Vec<StudyClip>,
    /// Segments of speech from which no clip could be cut.
    #[serde(alias = "refused")]
    pub rejected: Vec<RejectedSegment>,
}

/// Builds the study of `file` in the folder `out`, with films of `size` px, width and height
/// ([`super::file::FilmLayout::size`] except in tests).
///
/// # Errors
/// No H.264 encoder; the folder holds another study or responses; speech or motion is missing or too short.
pub fn build(file: &StudyFile, out: &Path, size: [usize; 2], progress: &dyn Progress) -> Result<BuiltStudy> {
    check_encoder()?;
    let folder = StudyFolder::new(out);
    ensure!(!out.is_file(), "{} is a file: expected a folder for the study (--out)", out.display());
    let _lock = lock(out)?;
    if folder.seal().exists() {
        return existing_study(file, &folder);
    }
    let has_responses = folder.responses().exists();
    ensure!(!has_responses, "{} contains responses: build into another folder (--out)", out.display());
    let n_clips = |speaker: &StudySpeaker| speaker.clips.unwrap_or_else(|| ClipNeeds::of(file).total());
    let rank = |clip: &str| -> u64 {
        let hash = blake3::hash(format!("{} clip {clip}", file.seed).as_bytes());
        hash.as_bytes()[..8].iter().fold(0, |number, byte| number << 8 | u64::from(*byte))
    };
    let task = progress.begin("clips", file.speaker.len() as u64);
    let cut = file.speaker.iter().map(|speaker| {
        let cut = CutSpeaker::new(file, speaker, n_clips(speaker), rank);
        task.advance(1);
        cut.with_context(|| format!("speaker {}", speaker.name))
    });
    let mut cut = cut.collect::<Result<Vec<CutSpeaker>>>()?;
    drop(task);
    let loudness_lufs =
        normalise_loudness(cut.iter_mut().flat_map(|speaker| speaker.sounds.iter_mut().chain(&mut speaker.tones)));
    let report = ClipReport { loudness_lufs, speakers: cut.iter().map(BuiltSpeaker::of).collect() };
    write_clips(&folder, &report, &cut)?;
    let named = |speaker: &CutSpeaker| {
        let clips = speaker.cut.best_first.iter().map(|clip| format!("{}/{clip}", speaker.name()));
        (speaker.name().to_owned(), clips.collect())
    };
    let clips: BTreeMap<String, Vec<String>> = cut.iter().map(named).collect();
    ClipNeeds::of(file).check(file, &clips)?;
    let filmed = cut.into_iter().map(|speaker| Ok((speaker.name().to_owned(), speaker.filmed(file, size, progress)?)));
    let filmed: BTreeMap<String, FilmedSpeaker> = filmed.collect::<Result<_>>()?;
    let mut key = StudyKey { films: BTreeMap::new() };
    let designed = design(file, &clips, &mut |mut content| {
        let speaker = filmed.get(&content.speaker).with_context(|| format!("unknown speaker {}", content.speaker))?;
        if content.motion_of == content.clip {
            content.motion_of = speaker.motion_of(&content)?;
        }
        if let (Some(alone), Some(right)) = (content.right_alone(), &mut content.right)
            && right.motion_of == content.clip
        {
            right.motion_of = speaker.motion_of(&alone)?;
        }
        let name = film_name(file.seed, &content);
        let is_unique = key.films.insert(name.clone(), content.clone()).is_none_or(|other| other == content);
        ensure!(is_unique, "two films have the name {name}: choose another seed");
        Ok(name)
    })?;
    let rendered = render_films(&folder, &key, &filmed, progress)?;
    publish(&folder, &rendered)?;
    file.write(&folder.study_file())?;
    write_json(&folder.plan(), &designed.plan)?;
    write_json(&folder.key(), &key)?;
    Preregistration::new(file).write(&folder.preregistration())?;
    StudySeal::of(&folder)?.write(&folder)?;
    let balance = designed.balance.iter().map(ToString::to_string).collect();
    let built = report.built(&folder, false, balance)?;
    remove(&unpublished_films_dir(&folder))?;
    Ok(built)
}

/// Summary of a study that is already built.
///
/// # Errors
/// The folder holds a study built from a different file.
fn existing_study(file: &StudyFile, folder: &StudyFolder) -> Result<BuiltStudy> {
    let existing = StudyFile::read(&folder.study_file())?;
    ensure!(
        existing == *file,
        "{} is sealed, and {} differs from this study file: build into another folder (--out)",
        folder.dir().display(),
        folder.study_file().display()
    );
    let report: ClipReport = read_json(&clips_dir(folder).join(CLIPS_FILE))?;
    remove(&unpublished_films_dir(folder))?;
    report.built(folder, true, Vec::new())
}

#[derive(Serialize, Deserialize)]
struct ClipReport {
    /// Loudness of the films, LUFS.
    loudness_lufs: f64,
    speakers: Vec<BuiltSpeaker>,
}

impl ClipReport {
    fn built(self, folder: &StudyFolder, up_to_date: bool, balance: Vec<String>) -> Result<BuiltStudy> {
        let plan: StudyPlan = read_json(&folder.plan())?;
        let key: StudyKey = read_json(&folder.key())?;
        let first = key.films.keys().next().context("the study has no films")?;
        let film = folder.film(first);
        Ok(BuiltStudy {
            folder: folder.dir().to_owned(),
            seal: StudySeal::verify(folder)?.seal,
            up_to_date,
            n_sessions: plan.sessions.len(),
            n_trials: plan.sessions.first().map_or(0, |session| session.trials.len()),
            n_films: key.films.len(),
            film_bytes: fs::metadata(&film).with_context(|| format!("cannot read {}", film.display()))?.len(),
            loudness_lufs: self.loudness_lufs,
            balance,
            speakers: self.speakers,
        })
    }
}

impl BuiltSpeaker {
    fn of(speaker: &CutSpeaker) -> Self {
        let (clips, rejected) = (speaker.cut.clips.clone(), speaker.cut.rejected.clone());
        Self { name: speaker.name().to_owned(), clips, rejected }
    }
}

/// Writes the sound of every clip, from which other systems can generate motion, and `clips.json`.
fn write_clips(folder: &StudyFolder, report: &ClipReport, speakers: &[CutSpeaker]) -> Result<()> {
    let clips = clips_dir(folder);
    for speaker in speakers {
        for (clip, sound) in speaker.cut.clips.iter().zip(&speaker.sounds) {
            let path = clips.join(speaker.name()).join(format!("{}.wav", clip.name));
            workdir::replace(&path, |attempt| wav::write(attempt, sound))?;
        }
    }
    write_json(&clips.join(CLIPS_FILE), report)
}

/// Renders the films of the key into a hidden folder, except those that exist, and returns their paths by opaque name.
/// File names are hashes of the content, so an interrupted build can resume.
fn render_films(
    folder: &StudyFolder,
    key: &StudyKey,
    speakers: &BTreeMap<String, FilmedSpeaker>,
    progress: &dyn Progress,
) -> Result<BTreeMap<String, PathBuf>> {
    let dir = unpublished_films_dir(folder);
    fs::create_dir_all(&dir).with_context(|| format!("cannot create the folder {}", dir.display()))?;
    let task = progress.begin("films", key.films.len() as u64);
    let film = |(name, content): (&String, &FilmContent)| -> Result<(String, PathBuf)> {
        let speaker = speakers.get(&content.speaker).with_context(|| format!("unknown speaker {}", content.speaker))?;
        let performances = speaker.performances(content)?;
        let scene = speaker.scene(content, &performances);
        let path = dir.join(format!("{}.mp4", scene.hash()));
        if path.is_file() {
            task.skip(1);
        } else {
            workdir::replace(&path, |attempt| scene.write(attempt))?;
            task.advance(1);
        }
        Ok((name.clone(), path))
    };
    key.films.par_iter().map(film).collect()
}

/// Replaces `public/` by the films, padded to the same size.
fn publish(folder: &StudyFolder, films: &BTreeMap<String, PathBuf>) -> Result<()> {
    let length = |path: &PathBuf| Ok(usize::try_from(fs::metadata(path)?.len())?);
    let lengths = films.values().map(length).collect::<Result<Vec<usize>>>();
    let n_bytes = common_bytes(lengths.with_context(|| format!("films in {}", folder.dir().display()))?);
    remove(&folder.public())?;
    for (name, path) in films {
        let film = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        write_file(&folder.film(name), &padded(film, n_bytes)?)?;
    }
    Ok(())
}

fn remove(path: &Path) -> Result<()> {
    workdir::remove(path).with_context(|| format!("cannot remove {}", path.display()))
}

fn clips_dir(folder: &StudyFolder) -> PathBuf {
    folder.dir().join("clips")
}

fn unpublished_films_dir(folder: &StudyFolder) -> PathBuf {
    folder.dir().join(".films")
}

/// Minimum size of an mp4 box: its size and type fields.
const BOX_HEADER_BYTES: usize = 8;
/// Film sizes are rounded up to a multiple of this.
const SIZE_STEP_BYTES: usize = 4096;

/// Smallest multiple of 4096 bytes to which films of these lengths can all be padded.
pub fn common_bytes(lengths: impl IntoIterator<Item = usize>) -> usize {
    let longest = lengths.into_iter().max().unwrap_or(0);
    (longest + BOX_HEADER_BYTES).next_multiple_of(SIZE_STEP_BYTES)
}

/// Appends a `free` box of zeros to an mp4, so that its size is `n_bytes`.
///
/// # Errors
/// The film is longer than `n_bytes` less a box header, or shorter by 4 GiB or more.
pub fn padded(mut film: Vec<u8>, n_bytes: usize) -> Result<Vec<u8>> {
    let missing = n_bytes.checked_sub(film.len()).filter(|missing| *missing >= BOX_HEADER_BYTES);
    let size = missing.and_then(|missing| u32::try_from(missing).ok());
    let size = size.with_context(|| format!("cannot pad a film of {} bytes to {n_bytes} bytes", film.len()))?;
    film.extend(size.to_be_bytes());
    film.extend(b"free");
    film.resize(n_bytes, 0);
    Ok(film)
}
