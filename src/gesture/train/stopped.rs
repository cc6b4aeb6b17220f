//! The error of a training that was asked to end.

use std::path::PathBuf;

/// A training that ended before its last step since it was asked to. Started again, it goes on behind `step`.
#[derive(Clone, Debug, thiserror::Error)]
#[error("stopped after step {step} of {steps}{}", self.checkpoint())]
pub struct StoppedTraining {
    /// Steps done, and steps of the whole training.
    pub step: usize,
    /// Steps of the whole training.
    pub steps: usize,
    /// Checkpoint of this step; `None`: there was no step.
    pub newest: Option<PathBuf>,
    /// Best checkpoint so far, and its step; `None`: nothing was validated yet, or this training chooses none.
    pub best: Option<(usize, PathBuf)>,
}

impl StoppedTraining {
    fn checkpoint(&self) -> String {
        let Some(newest) = &self.newest else { return ", with no checkpoint yet".to_owned() };
        format!("; the checkpoint {} goes on from there", newest.display())
    }
}
