//! The stage: one unit a sound, whose motion goes into the common folder in each of the formats.

use super::motion_files::{checkpoint_file, model_lock, write_motion};
use super::sounds::BatchSound;
use crate::animate::AnimationOptions;
use crate::animate::export::file::ExportFormat;
use crate::generate::GestureGenerator;
use crate::stage::progress::Progress;
use crate::stage::workdir::FolderLock;
use crate::stage::{Input, Report, Stage, Unit};
use anyhow::{Context, Result, bail, ensure};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Sounds to motion files.
pub struct BatchStage {
    sounds: BTreeMap<String, BatchSound>,
    /// Endings with their formats.
    formats: Vec<(String, ExportFormat)>,
    folder: PathBuf,
    /// Of the sounds that name none.
    checkpoint: Option<PathBuf>,
    /// The models in use, with the locks of their folders.
    generators: Mutex<BTreeMap<PathBuf, (Arc<GestureGenerator>, FolderLock)>>,
}

impl BatchStage {
    /// Writes into `folder` in the formats of those endings. `checkpoint`, a file or a training's folder, is for sounds
    /// that name none.
    ///
    /// # Errors
    /// An ending that is unknown or named twice, a sound without a checkpoint, a `checkpoint` that cannot be read.
    pub fn new(sounds: &[BatchSound], endings: &[String], folder: &Path, checkpoint: Option<&Path>) -> Result<Self> {
        let checkpoint = checkpoint.map(checkpoint_file).transpose()?;
        if checkpoint.is_none()
            && let Some(sound) = sounds.iter().find(|sound| sound.checkpoint.is_none())
        {
            bail!("the table names no checkpoint for {}; give --checkpoint", sound.audio.display());
        }
        let stage = Self {
            sounds: sounds.iter().map(|sound| (sound.name.clone(), sound.clone())).collect(),
            formats: formats(endings)?,
            folder: folder.to_owned(),
            checkpoint,
            generators: Mutex::default(),
        };
        // A common checkpoint that cannot be read fails all sounds, and does so before any.
        stage.checkpoint.as_deref().map(|path| stage.generator(path)).transpose()?;
        Ok(stage)
    }

    /// The unit of a sound.
    pub fn unit(sound: &BatchSound) -> Unit {
        Unit { speaker: String::new(), video: sound.name.clone(), source: sound.audio.clone() }
    }

    fn checkpoint_of(&self, unit: &Unit) -> Result<PathBuf> {
        let sound = self.sounds.get(&unit.video).with_context(|| format!("{unit} is no sound of this batch"))?;
        let own = sound.checkpoint.as_deref().map(checkpoint_file).transpose()?;
        own.or_else(|| self.checkpoint.clone()).context("no checkpoint is named")
    }

    fn generator(&self, checkpoint: &Path) -> Result<Arc<GestureGenerator>> {
        let mut generators = self.generators.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if let Some((generator, _)) = generators.get(checkpoint) {
            return Ok(generator.clone());
        }
        let lock = model_lock(checkpoint)?;
        let generator = Arc::new(GestureGenerator::open(checkpoint)?);
        generators.insert(checkpoint.to_owned(), (generator.clone(), lock));
        Ok(generator)
    }
}

impl Stage for BatchStage {
    fn name(&self) -> &'static str {
        "generate"
    }

    fn version(&self) -> u32 {
        1
    }

    fn settings(&self, _unit: &Unit) -> serde_json::Value {
        let endings: Vec<&str> = self.formats.iter().map(|(ending, _)| ending.as_str()).collect();
        json!({ "formats": endings, "animation": format!("{:?}", AnimationOptions::default()) })
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        let input = |role: &str, path| Input { role: role.to_owned(), path };
        Ok(vec![input("sound", unit.source.clone()), input("checkpoint", self.checkpoint_of(unit)?)])
    }

    fn common_folder(&self) -> Option<&Path> {
        Some(&self.folder)
    }

    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        let generator = self.generator(&self.checkpoint_of(unit)?)?;
        let file = |ending: &str| format!("{}.{ending}", unit.video);
        for (ending, _) in &self.formats {
            let path = self.folder.join(file(ending));
            let is_sound = path.canonicalize().is_ok_and(|p| unit.source.canonicalize().is_ok_and(|s| s == p));
            ensure!(!is_sound, "{} is the speech itself; choose another --out-folder", path.display());
        }
        let outputs: Vec<(PathBuf, ExportFormat)> =
            self.formats.iter().map(|(ending, format)| (out.join(file(ending)), *format)).collect();
        let written = write_motion(&generator, &unit.source, &outputs, progress)?;
        let facts = json!({
            "secs": written.secs, "n_frames": written.n_frames, "speaker": generator.name(), "note": written.note,
        });
        Ok(Report { line: String::new(), facts: facts.as_object().cloned().unwrap_or_default() })
    }
}

/// The formats by their endings.
fn formats(endings: &[String]) -> Result<Vec<(String, ExportFormat)>> {
    let mut formats: Vec<(String, ExportFormat)> = Vec::new();
    for ending in endings {
        let ending = ending.trim().trim_start_matches('.').to_lowercase();
        let format = ExportFormat::from_path(Path::new(&format!("motion.{ending}"))).context("--format")?;
        ensure!(formats.iter().all(|(known, _)| *known != ending), "--format names {ending} twice");
        formats.push((ending, format));
    }
    Ok(formats)
}
