//! Choice of the speech detector: what the configuration asks for, and whether the model is installed.

use super::speech_activity;
use anyhow::{Context, Result};
use orator_base::types::time::FrameRate;
use orator_dataset::config::{Settings, SpeechRule};
use orator_dataset::info::ModelUsed;
use orator_onnx::speech::SpeechModel;
use orator_onnx::{ModelEntry, ModelError, ModelRequest, ModelRole, ModelState, ModelStore, Runtime};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Speech model of a configuration, located but not opened.
#[derive(Clone, Debug)]
pub struct SpeechDetector {
    entry: ModelEntry,
    models: PathBuf,
    library: PathBuf,
}

impl SpeechDetector {
    /// Finds the model if it is requested and installed; `None`: speech is detected by loudness only.
    ///
    /// # Errors
    /// An invalid manifest; a model that is requested explicitly and not installed.
    pub fn find(settings: &Settings) -> Result<Option<Self>> {
        if settings.segment.speech == SpeechRule::Loudness {
            return Ok(None);
        }
        let store = ModelStore::open(&settings.models.dir)?;
        let entry = store.manifest().models.iter().find(|entry| entry.role == ModelRole::Speech);
        let entry = entry.context("the model manifest lists no model with the role speech")?;
        if settings.segment.speech == SpeechRule::Auto && store.state(entry) != ModelState::Present {
            return Ok(None);
        }
        if !store.path(entry).exists() {
            return Err(ModelError::Missing { id: entry.id.clone(), path: store.path(entry) }.into());
        }
        let (models, library) = (settings.models.dir.clone(), settings.models.onnxruntime.clone());
        Ok(Some(Self { entry: entry.clone(), models, library }))
    }

    /// Model to pass to `ModelStore::fetch`, unless only loudness is requested.
    pub fn required_models(settings: &Settings) -> Option<ModelRequest> {
        (settings.segment.speech != SpeechRule::Loudness).then_some(ModelRequest::Role(ModelRole::Speech))
    }

    /// Advice to print once in a run without the optional model.
    ///
    /// # Errors
    /// Those of `find`.
    pub fn advice(settings: &Settings) -> Result<Option<&'static str>> {
        let is_missing = settings.segment.speech == SpeechRule::Auto && Self::find(settings)?.is_none();
        Ok(is_missing.then_some(
            "no speech model is installed, so speech is detected by loudness only, and music or applause count as \
             speech: install one with `orator models fetch`",
        ))
    }

    /// Description of the speech detection, for the data card.
    ///
    /// # Errors
    /// Those of `find`.
    pub fn note(settings: &Settings) -> Result<String> {
        Ok(match Self::find(settings)? {
            Some(detector) => format!(
                "Kept sound is speech as the model {} tells it, at least {:.0} % of the 4 s around each frame.",
                detector.entry.id,
                100.0 * settings.segment.min_speech
            ),
            None => "Speech was told by loudness alone: kept sound may be music or applause.".to_owned(),
        })
    }

    /// Ranges with speech in the audio file `path`, seconds.
    ///
    /// # Errors
    /// Those of `shares`.
    pub fn ranges(&self, path: &Path) -> Result<Vec<Range<f64>>> {
        speech_activity::ranges(path, &mut self.open()?)
    }

    fn open(&self) -> Result<SpeechModel> {
        let runtime = Runtime::load(&self.library, &self.models)?;
        Ok(SpeechModel::open(&runtime, &self.entry, &self.models)?)
    }

    /// Share of speech around each frame, from the audio file `path`.
    ///
    /// # Errors
    /// A model that cannot be opened or fails; a file that cannot be read.
    pub fn shares(&self, path: &Path, fps: FrameRate, n_frames: usize) -> Result<Vec<f32>> {
        speech_activity::shares(path, &mut self.open()?, fps, n_frames)
    }

    /// Description of the model for `info.json`.
    pub fn used(&self) -> ModelUsed {
        let ModelEntry { id, sha256, origin, .. } = self.entry.clone();
        ModelUsed { role: "speech".into(), id, sha256, licence: origin.licence }
    }
}
