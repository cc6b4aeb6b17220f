//! The batch as a stage with one unit per sound, whose motion is written to a common folder in all formats.

use super::job::SpeechBatch;
use super::motion_files;
use super::sounds::BatchSound;
use super::speech::SpeechSource;
use crate::generate::model::{checkpoint_file, model_lock};
use crate::generate::seq2seq::metadata::is_sequence;
use crate::generate::trained::TrainedSpeaker;
use anyhow::{Context, Result, bail, ensure};
use orator_avatar::animate::AnimationOptions;
use orator_avatar::animate::export::file::{ExportFormat, FigureOptions};
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir::FolderLock;
use orator_base::stage::{Input, Report, Stage, Unit};
use orator_formats::word_vectors::WordVectors;
use orator_nn::seq2seq::predict::StateAtSeams;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Stage that generates motion files for sounds.
pub struct BatchStage<'a> {
    batch: &'a SpeechBatch,
    sounds: BTreeMap<&'a str, &'a BatchSound>,
    /// Formats with their file extensions.
    formats: Vec<(String, ExportFormat)>,
    /// Checkpoint file for sounds without their own.
    checkpoint: Option<PathBuf>,
    /// Vectors of words outside the vocabularies.
    vectors: Option<Arc<WordVectors>>,
    /// Loaded models by checkpoint file, with the locks of their folders.
    speakers: Mutex<BTreeMap<PathBuf, (Arc<TrainedSpeaker>, FolderLock)>>,
}

impl<'a> BatchStage<'a> {
    /// Stage of a batch.
    ///
    /// # Errors
    /// A format that is unknown or given twice, a sound without a checkpoint, a common checkpoint or a table of word
    /// vectors that cannot be read, a table that the common checkpoint does not read.
    pub fn new(batch: &'a SpeechBatch) -> Result<Self> {
        let checkpoint = batch.checkpoint.as_deref().map(checkpoint_file).transpose()?;
        if checkpoint.is_none()
            && let Some(sound) = batch.sounds.iter().find(|sound| sound.checkpoint.is_none())
        {
            bail!("no checkpoint for {}: add one to the table, or give --checkpoint", sound.audio.display());
        }
        let sounds = batch.sounds.iter().map(|sound| (sound.name.as_str(), sound)).collect();
        let formats = formats(&batch.formats)?;
        let vectors = batch.words.as_deref().map(WordVectors::open).transpose()?.map(Arc::new);
        let stage = Self { batch, sounds, formats, checkpoint, vectors, speakers: Mutex::default() };
        // Loaded immediately, because a broken common checkpoint would fail all sounds.
        stage.checkpoint.as_deref().map(|path| stage.speaker(path)).transpose()?;
        Ok(stage)
    }

    /// Unit of a sound.
    pub fn unit(sound: &BatchSound) -> Unit {
        Unit { speaker: String::new(), video: sound.name.clone(), source: sound.audio.clone() }
    }

    fn sound(&self, unit: &Unit) -> Result<&BatchSound> {
        self.sounds
            .get(unit.video.as_str())
            .copied()
            .with_context(|| format!("{unit} is not an audio file of this batch"))
    }

    /// Transcript of a sound, if its checkpoint is a sequence-to-sequence network; others do not read it.
    fn transcript_of(&self, unit: &Unit) -> Result<Option<&Path>> {
        let transcript = self.sound(unit)?.transcript.as_deref();
        Ok(transcript.filter(|_| self.checkpoint_of(unit).and_then(|path| is_sequence(&path)).unwrap_or(false)))
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
        let mut speaker = TrainedSpeaker::open(checkpoint)?;
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

/// Formats for file extensions.
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
