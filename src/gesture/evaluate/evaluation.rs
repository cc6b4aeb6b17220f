//! An evaluation: motions with their ground truth, and the baselines that are measured with them.

use super::baseline::baselines::{self, Predictor};
use super::clips::checkpoint::EvaluatedCheckpoint;
use super::clips::clips::{self, EvalClips};
use super::clips::motion_store::MotionStore;
use super::clips::{from_checkpoints, pairs};
use super::table::table::{self, Table};
use crate::metrics::settings::MetricSettings;
use anyhow::{Result, ensure};
use orator_base::stage::progress::Progress;
use orator_base::types::time::FrameRate;
use orator_dataset::{Dataset, Split};
use std::path::Path;

/// Motions to be evaluated against their ground truth.
pub struct Evaluation {
    /// Clips with ground truth and sound.
    pub clips: EvalClips,
    /// The motions under test, followed by the baselines.
    pub predictors: Vec<Predictor>,
}

impl Evaluation {
    /// Reads motion files: `truth` and `prediction` are two files, or two folders whose files have the same names;
    /// `audio` is a sound or a folder of sounds. `fps`: rate of files that state none. Motions are saved in `store`.
    pub fn from_files(
        truth: &Path,
        prediction: &Path,
        audio: Option<&Path>,
        fps: Option<FrameRate>,
        store: &MotionStore,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let task = progress.begin("evaluating", 0);
        task.detail("reading");
        let found = pairs::find(truth, prediction, audio)?;
        let mut clips = clips::read(&found.pairs, fps, store)?;
        if let Some(audio) = audio {
            ensure!(clips.have_sound() || audio.is_dir(), "{} has no audio", audio.display());
        }
        clips.notes.splice(0..0, found.notes);
        let mut predictors = vec![Predictor::prediction(&clips, "the evaluated motion")];
        let (others, left_out) = baselines::from_files(&clips, store)?;
        predictors.extend(others);
        clips.notes.extend(left_out);
        Ok(Self { clips, predictors })
    }

    /// Generates motion with each checkpoint for the sounds and words of a split of the dataset, whose motion is the
    /// ground truth: joints [T, 49, 3] in metres at the dataset's frame rate. If a checkpoint animates a captured
    /// skeleton, all predictors are measured on its joints, which a note lists. The motions are saved in `store`.
    ///
    /// # Errors
    /// No checkpoint; a split without samples; a dataset of another frame rate than a checkpoint (motion of a captured
    /// skeleton is resampled instead).
    pub fn of_generators(
        dataset: &Dataset,
        checkpoints: &[EvaluatedCheckpoint],
        split: Split,
        store: &MotionStore,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let task = progress.begin("evaluating", 0);
        let (clips, predictors) = from_checkpoints::prepare(dataset, checkpoints, split, store, &*task)?;
        Ok(Self { clips, predictors })
    }

    /// Measures every predictor.
    ///
    /// # Errors
    /// Settings that the metric catalogue rejects; no frame to measure.
    pub fn measure(&self, settings: &MetricSettings, progress: &dyn Progress) -> Result<Table> {
        table::measure(&self.clips, settings, &self.predictors, &*progress.begin("evaluating", 0))
    }
}
