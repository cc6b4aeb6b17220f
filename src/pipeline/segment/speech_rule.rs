//! Whether a speech model detects speech: what the configuration asks for, and whether the model is there.

use super::speech_activity;
use anyhow::{Context, Result};
use orator_base::types::time::FrameRate;
use orator_dataset::config::{Settings, SpeechRule};
use orator_dataset::info::ModelUsed;
use orator_onnx::speech::SpeechModel;
use orator_onnx::{ModelEntry, ModelError, ModelRole, ModelState, ModelStore, Runtime, Wanted};
use std::path::{Path, PathBuf};

/// The speech model of a configuration, found but not opened.
#[derive(Clone, Debug)]
pub struct SpeechDetector {
    entry: ModelEntry,
    models: PathBuf,
    library: PathBuf,
}

impl SpeechDetector {
    /// The model where it is asked for and there; `None`: loudness alone is the rule.
    ///
    /// # Errors
    /// A manifest that is not sound; the model is asked for by name and not there.
    pub fn find(settings: &Settings) -> Result<Option<Self>> {
        if settings.segment.speech == SpeechRule::Loudness {
            return Ok(None);
        }
        let store = ModelStore::open(&settings.models.dir)?;
        let entry = store.manifest().models.iter().find(|entry| entry.role == ModelRole::Speech);
        let entry = entry.context("the manifest of models has none of the role speech")?;
        if settings.segment.speech == SpeechRule::Auto && store.state(entry) != ModelState::Present {
            return Ok(None);
        }
        if !store.path(entry).exists() {
            return Err(ModelError::Missing { id: entry.id.clone(), path: store.path(entry) }.into());
        }
        let (models, library) = (settings.models.dir.clone(), settings.models.onnxruntime.clone());
        Ok(Some(Self { entry: entry.clone(), models, library }))
    }

    /// The model for `ModelStore::fetch`, unless loudness alone is asked for.
    pub fn wanted(settings: &Settings) -> Option<Wanted> {
        (settings.segment.speech != SpeechRule::Loudness).then_some(Wanted::Role(ModelRole::Speech))
    }

    /// What to say once of a run without the model that might have it.
    pub fn advice(settings: &Settings) -> Result<Option<&'static str>> {
        let is_missing = settings.segment.speech == SpeechRule::Auto && Self::find(settings)?.is_none();
        Ok(is_missing.then_some(
            "speech is told by loudness alone, so music and applause count: `orator models fetch` gets the model that \
             tells speech",
        ))
    }

    /// How speech was detected, for the card of a dataset.
    ///
    /// # Errors
    /// Those of `find`.
    pub fn note(settings: &Settings) -> Result<String> {
        Ok(match Self::find(settings)? {
            Some(listener) => format!(
                "Kept sound is speech as the model {} tells it, at least {:.0} % of the 4 s around each frame.",
                listener.entry.id,
                100.0 * settings.segment.min_speech
            ),
            None => "Speech was told by loudness alone: kept sound may be music or applause.".to_owned(),
        })
    }

    /// Share of speech around each frame of the sound in the file at `path`.
    ///
    /// # Errors
    /// What is wrong with the model or the file.
    pub fn shares(&self, path: &Path, fps: FrameRate, n_frames: usize) -> Result<Vec<f32>> {
        let runtime = Runtime::load(&self.library, &self.models)?;
        let mut model = SpeechModel::open(&runtime, &self.entry, &self.models)?;
        speech_activity::shares(path, &mut model, fps, n_frames)
    }

    /// The model as it is named in a dataset.
    pub fn used(&self) -> ModelUsed {
        let ModelEntry { id, sha256, origin, .. } = self.entry.clone();
        ModelUsed { role: "speech".into(), id, sha256, licence: origin.licence }
    }
}
