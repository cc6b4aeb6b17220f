//! The loop of a training whose best step is chosen by validation: steps, at the end of each epoch a validation,
//! checkpoints on the way.

use super::log::MetricsLog;
use super::resume::kept;
use crate::formats::checkpoint;
use crate::stage::progress::Progress;
use anyhow::{Context, Result, bail};
use serde::Serialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Steps between two lines of the log.
const LOG_EVERY: usize = 10;

/// When what is done, in steps.
#[derive(Clone, Copy, Debug)]
pub struct EpochSchedule {
    pub steps: usize,
    pub epoch_steps: usize,
    pub checkpoint_every: usize,
    /// Epochs after which a training ends whose score has not become better; 0: never.
    pub patience: usize,
}

/// What a step says: its line of the log, and a few words for the progress.
pub struct StepReport {
    pub line: Value,
    pub words: String,
}

/// A network in training, its data and its validation.
pub trait ValidatedTraining {
    /// What a validation says.
    type Validation: Serialize;

    /// The speaker's name, and the section of the configuration.
    fn names(&self) -> (&str, &'static str);
    fn schedule(&self) -> EpochSchedule;
    /// Steps done.
    fn n_done(&self) -> usize;
    /// Step and score of the best validation so far.
    fn best(&mut self) -> &mut Option<(usize, f32)>;
    /// One step. Errors when a loss is not finite or has exploded.
    fn step(&mut self) -> Result<StepReport>;
    fn validate(&self) -> Result<Self::Validation>;
    /// The score, lower is better, and why the network has collapsed, if it has.
    fn judged(validation: &Self::Validation) -> (f64, Option<&str>);
    fn save(&self, folder: &Path) -> Result<()>;
    fn save_best(&self, folder: &Path, validation: &Self::Validation) -> Result<()>;
}

/// How the loop ended.
pub struct EpochsEnd<V> {
    /// The step it began at.
    pub began_at: usize,
    pub stopped_early: bool,
    /// Of the newest checkpoint.
    pub validation: V,
    pub newest: PathBuf,
    pub best_step: usize,
}

/// Trains to the last step, or until the score no longer becomes better. Errors: those of a step, with the checkpoint that is
/// kept; no step to do and no checkpoint.
pub fn run<T: ValidatedTraining>(
    training: &mut T,
    folder: &Path,
    progress: &dyn Progress,
) -> Result<EpochsEnd<T::Validation>> {
    let EpochSchedule { steps, epoch_steps, checkpoint_every, .. } = training.schedule();
    let section = training.names().1;
    let began_at = training.n_done();
    let mut log = MetricsLog::open(folder, began_at)?;
    let task = progress.begin(&format!("train {}", training.names().0), steps as u64);
    task.advance(began_at.min(steps) as u64);
    let start = Instant::now();
    let mut last = None;
    while training.n_done() < steps && !is_over(training) {
        let report = training.step().with_context(|| kept(folder, section))?;
        let step = training.n_done();
        task.advance(1);
        if step.is_multiple_of(LOG_EVERY) {
            let speed = (step - began_at) as f64 / start.elapsed().as_secs_f64().max(1e-9);
            task.detail(&format!("{}  {speed:.2} steps/s", report.words));
            log.write(&report.line)?;
        }
        let is_last = step == steps;
        let ends_epoch = step.is_multiple_of(epoch_steps);
        if ends_epoch || is_last {
            let validation = training.validate()?;
            log.write(&json!({ "step": step, "epoch": step.div_ceil(epoch_steps), "validation": validation }))?;
            let (score, alarm) = T::judged(&validation);
            if let (Some(alarm), true) = (alarm, step > epoch_steps) {
                progress.say(&format!("step {step}: {alarm}"));
            }
            // In f32, whose decimals come back exactly from JSON.
            let score = score as f32;
            if training.best().is_none_or(|(_, best)| score < best) {
                *training.best() = Some((step, score));
                training.save_best(folder, &validation)?;
            }
            last = Some(validation);
        }
        if ends_epoch || is_last || step.is_multiple_of(checkpoint_every) {
            training.save(folder)?;
        }
    }
    let Some((_, newest)) = checkpoint::list(folder)?.pop() else {
        bail!("{section}.steps is 0: nothing to train");
    };
    let validation = match last {
        Some(validation) => validation,
        None => training.validate()?,
    };
    let done = training.n_done();
    let best_step = training.best().map_or(done, |(step, _)| step);
    Ok(EpochsEnd { began_at, stopped_early: done < steps, validation, newest, best_step })
}

/// Whether the score has not become better for as many epochs as the patience allows.
fn is_over(training: &mut impl ValidatedTraining) -> bool {
    let EpochSchedule { patience, epoch_steps, .. } = training.schedule();
    let done = training.n_done();
    let since = done - training.best().map_or(done, |(step, _)| step.min(done));
    patience > 0 && since >= patience * epoch_steps
}
