//! A batch of sounds: its settings, a report with the outcome of each sound, and the run as a stage with one unit per
//! sound, whose motion is written to a common folder in all formats.

use super::motion_files;
use super::sounds::BatchSound;
use super::speech::SpeechSource;
use crate::generate::model::{GenerationChoice, checkpoint_file, model_lock};
use crate::generate::seq2seq::metadata::reads_transcript;
use crate::generate::trained::TrainedSpeaker;
use anyhow::{Context, Result, bail, ensure};
use candle_core::Device;
use orator_avatar::animate::AnimationOptions;
use orator_avatar::animate::export::file::{ExportFormat, FigureOptions};
use orator_base::stage::fingerprint::HashCache;
use orator_base::stage::progress::Progress;
use orator_base::stage::runner::{self, StageOutcome};
use orator_base::stage::workdir::{self, FolderLock};
use orator_base::stage::{Input, Report, Stage, Unit, artifacts};
use orator_formats::word_vectors::WordVectors;
use orator_nn::seq2seq::predict::StateAtSeams;
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Stage that generates motion files for sounds.
pub struct BatchStage<'a> {
    batch: &'a SpeechBatch,
    device: &'a Device,
    sounds: BTreeMap<&'a str, &'a BatchSound>,
    formats: Vec<(String, ExportFormat)>,
    /// Checkpoint file for sounds without their own.
    checkpoint: Option<PathBuf>,
    vectors: Option<Arc<WordVectors>>,
    /// Loaded models by checkpoint file, with the locks of their folders.
    speakers: Mutex<BTreeMap<PathBuf, (Arc<TrainedSpeaker>, FolderLock)>>,
}

impl<'a> BatchStage<'a> {
    /// Stage of a batch, with its networks on `device`.
    ///
    /// # Errors
    /// A format that is unknown or given twice, a sound without a checkpoint, a common checkpoint or a table of word
    /// vectors that cannot be read, a table that the common checkpoint does not read.
    pub fn new(batch: &'a SpeechBatch, device: &'a Device) -> Result<Self> {
        let checkpoint = batch.checkpoint.as_deref().map(checkpoint_file).transpose()?;
        if checkpoint.is_none()
            && let Some(sound) = batch.sounds.iter().find(|sound| sound.checkpoint.is_none())
        {
            bail!("no checkpoint for {}: add one to the table, or give --checkpoint", sound.audio.display());
        }
        let sounds = batch.sounds.iter().map(|sound| (sound.name.as_str(), sound)).collect();
        let formats = formats(&batch.formats)?;
        let vectors = batch.words.as_deref().map(WordVectors::open).transpose()?.map(Arc::new);
        let stage = Self { batch, device, sounds, formats, checkpoint, vectors, speakers: Mutex::default() };
        // Loaded immediately, because a broken common checkpoint would fail all sounds.
        stage.checkpoint.as_deref().map(|path| stage.speaker(path)).transpose()?;
        Ok(stage)
    }

    pub fn unit(sound: &BatchSound) -> Unit {
        Unit { speaker: String::new(), video: sound.name.clone(), source: sound.audio.clone() }
    }

    fn sound(&self, unit: &Unit) -> Result<&BatchSound> {
        self.sounds
            .get(unit.video.as_str())
            .copied()
            .with_context(|| format!("{unit} is not an audio file of this batch"))
    }

    /// Transcript of a sound, if its checkpoint uses it.
    fn transcript_of(&self, unit: &Unit) -> Result<Option<&Path>> {
        let transcript = self.sound(unit)?.transcript.as_deref();
        Ok(transcript.filter(|_| self.checkpoint_of(unit).and_then(|path| reads_transcript(&path)).unwrap_or(false)))
    }

    fn checkpoint_of(&self, unit: &Unit) -> Result<PathBuf> {
        let sound = self.sound(unit)?;
        let own = sound.checkpoint.as_deref().map(checkpoint_file).transpose()?;
        own.or_else(|| self.checkpoint.clone()).context("no checkpoint: give --checkpoint")
    }

    fn speaker(&self, checkpoint: &Path) -> Result<Arc<TrainedSpeaker>> {
        let mut speakers = self.speakers.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if let Some((speaker, _)) = speakers.get(checkpoint) {
            return Ok(speaker.clone());
        }
        let lock = model_lock(checkpoint)?;
        let mut speaker = TrainedSpeaker::open_as(checkpoint, &GenerationChoice::default(), self.device)?;
        if let Some(vectors) = &self.vectors {
            speaker.set_word_vectors(vectors.clone())?;
        }
        let speaker = Arc::new(speaker);
        speakers.insert(checkpoint.to_owned(), (speaker.clone(), lock));
        Ok(speaker)
    }
}

impl Stage for BatchStage<'_> {
    fn name(&self) -> &'static str {
        "generate"
    }

    fn version(&self) -> u32 {
        2
    }

    fn settings(&self, _unit: &Unit) -> serde_json::Value {
        let endings: Vec<&str> = self.formats.iter().map(|(ending, _)| ending.as_str()).collect();
        let mut settings = json!({ "formats": endings, "animation": format!("{:?}", AnimationOptions::default()) });
        if self.batch.carry_state {
            settings["state"] = json!(StateAtSeams::Carried);
        }
        if self.batch.figure != FigureOptions::default() {
            settings["figure"] = json!({ "names": self.batch.figure.names.label(), "fps": self.batch.figure.fps });
        }
        settings
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        let input = |role: &str, path| Input { role: role.to_owned(), path };
        let transcript = self.transcript_of(unit)?.map(|path| input("transcript", path.to_owned()));
        let words = self.batch.words.clone().map(|path| input("words", path));
        let needed = [input("sound", unit.source.clone()), input("checkpoint", self.checkpoint_of(unit)?)];
        Ok(needed.into_iter().chain(transcript).chain(words).collect())
    }

    fn common_folder(&self) -> Option<&Path> {
        Some(&self.batch.folder)
    }

    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        let speaker = self.speaker(&self.checkpoint_of(unit)?)?;
        let file = |ending: &str| format!("{}.{ending}", unit.video);
        for (ending, _) in &self.formats {
            let path = self.batch.folder.join(file(ending));
            let is_sound = path.canonicalize().is_ok_and(|p| unit.source.canonicalize().is_ok_and(|s| s == p));
            ensure!(
                !is_sound,
                "the motion would overwrite its audio file {}; choose another --out-folder",
                path.display()
            );
        }
        let outputs: Vec<(PathBuf, ExportFormat)> =
            self.formats.iter().map(|(ending, format)| (out.join(file(ending)), *format)).collect();
        let SpeechBatch { carry_state, figure, .. } = *self.batch;
        let source = SpeechSource { audio: &unit.source, transcript: self.transcript_of(unit)?, carry_state, figure };
        let written = motion_files::write(&speaker, &source, &outputs, progress)?;
        let mut facts = json!({
            "secs": written.secs, "n_frames": written.n_frames, "speaker": speaker.name(), "note": written.note,
        });
        if let Some(segments) = &written.segments {
            facts["segments"] = json!(segments);
        }
        Ok(Report { line: String::new(), facts: facts.as_object().cloned().unwrap_or_default() })
    }
}

fn formats(endings: &[String]) -> Result<Vec<(String, ExportFormat)>> {
    let mut formats: Vec<(String, ExportFormat)> = Vec::new();
    for ending in endings {
        let ending = ending.trim().trim_start_matches('.').to_lowercase();
        let format = ExportFormat::from_path(Path::new(&format!("motion.{ending}"))).context("--format")?;
        ensure!(formats.iter().all(|(known, _)| *known != ending), "--format lists {ending} twice");
        formats.push((ending, format));
    }
    Ok(formats)
}

/// Folder of the records, below that of the motions.
const RECORDS: &str = ".made";

/// Sounds for which motion files are to be generated.
#[derive(Clone, Debug, Default)]
pub struct SpeechBatch {
    /// The sounds (`sounds::of_folder`, `sounds::of_table`).
    pub sounds: Vec<BatchSound>,
    /// Files of the folder that are neither sounds nor transcripts.
    pub passed_over: Vec<String>,
    pub folder: PathBuf,
    /// File extensions of the output formats: npy, txt, json, bvh, fbx, glb, vrm, vrma, mp4.
    pub formats: Vec<String>,
    /// Checkpoint, or folder of a training, for sounds without their own.
    pub checkpoint: Option<PathBuf>,
    /// Table of vectors for words that are not in the vocabulary of a sequence-to-sequence network.
    pub words: Option<PathBuf>,
    /// Whether sequence-to-sequence networks are requested to carry their decoder state across segments.
    pub carry_state: bool,
    /// Bone names and frame rate of exported figures.
    pub figure: FigureOptions,
    /// Whether up-to-date motions are generated again.
    pub again: bool,
}

#[derive(Clone, Debug, Default, Serialize)]
pub struct BatchReport {
    /// Number of sounds whose motion was generated.
    pub created: usize,
    /// Number of sounds whose motion was up to date.
    pub up_to_date: usize,
    pub failed: usize,
    /// Files of the folder that are neither sounds nor transcripts.
    pub passed_over: Vec<String>,
    pub out_folder: PathBuf,
    /// Outcome of every sound, in the order of the batch.
    pub sounds: Vec<BatchOutcome>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BatchOutcome {
    pub audio: PathBuf,
    /// Path of the motion below the output folder, without an extension.
    pub out: String,
    pub ended: BatchState,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// `secs` of sound, `n_frames` of motion, `speaker`, `note`, and `segments` of a sequence network; empty if failed.
    #[serde(flatten)]
    pub facts: Map<String, Value>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BatchState {
    /// The motion was generated.
    Created,
    /// The motion was already up to date.
    UpToDate,
    /// The sound failed, which does not stop the others.
    Failed,
}

impl SpeechBatch {
    /// Generates motions that are missing or out of date, on `device`.
    ///
    /// # Errors
    /// Errors that affect all sounds: an unknown format, an unreadable common checkpoint, another batch in the folder.
    pub fn run(&self, device: &Device, progress: &dyn Progress) -> Result<BatchReport> {
        let stage = BatchStage::new(self, device)?;
        let records = self.folder.join(RECORDS);
        let _lock = workdir::lock(&records)?;
        let hashes = HashCache::open(&artifacts::hashes(&records));
        let units: Vec<_> = self.sounds.iter().map(BatchStage::unit).collect();
        // One sound at a time, since the network itself uses all cores.
        let ended = runner::run(&stage, &units, &records, &hashes, (1, self.again), progress);
        hashes.save()?;
        let (out_folder, passed_over) = (self.folder.clone(), self.passed_over.clone());
        let mut report = BatchReport { passed_over, out_folder, ..BatchReport::default() };
        for (sound, ended) in self.sounds.iter().zip(ended) {
            let (count, ended, error, facts) = match ended {
                StageOutcome::Done(done) => (&mut report.created, BatchState::Created, None, done.facts),
                StageOutcome::Skipped(done) => (&mut report.up_to_date, BatchState::UpToDate, None, done.facts),
                StageOutcome::Failed(error) => {
                    (&mut report.failed, BatchState::Failed, Some(format!("{error:#}")), Map::new())
                }
            };
            *count += 1;
            let (audio, out) = (sound.audio.clone(), sound.name.clone());
            report.sounds.push(BatchOutcome { audio, out, ended, error, facts });
        }
        Ok(report)
    }
}
