//! Training loop that selects the best step by validation: optimiser steps, a validation after each epoch, and periodic
//! checkpoints. A stop request takes effect after the current step, with a checkpoint.

use super::log::{MetricsLog, ProgressLog};
use super::resume::last_checkpoint;
use crate::generate::model::BEST;
use anyhow::{Context, Result, bail};
use orator_base::stage::progress::Progress;
use orator_formats::checkpoint;
use serde::Serialize;
use serde_json::{Value, json};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Steps between two lines of `metrics.jsonl`.
pub const LOG_EVERY: usize = 10;

/// Intervals of the loop, in steps unless stated otherwise.
#[derive(Clone, Copy, Debug)]
pub struct EpochSchedule {
    pub steps: usize,
    pub epoch_steps: usize,
    pub checkpoint_every: usize,
    /// Epochs without a better score after which the training ends, with a decay of the learning rate; 0: never.
    pub patience: usize,
    /// Steps of that decay as a share of the steps before it; 0: the training ends at once.
    pub decay_share: f64,
}

impl EpochSchedule {
    /// Whether the score has not improved for `patience` epochs.
    fn is_plateau(&self, done: usize, best: Option<(usize, f32)>) -> bool {
        let n_since_best = done - best.map_or(done, |(step, _)| step.min(done));
        self.patience > 0 && n_since_best >= self.patience * self.epoch_steps
    }

    /// Decay of the learning rate if it begins after the validation of step `done`, which depends only on the scores so
    /// far. It ends with a validation. The decay that ends with `steps` is not replaced once it has begun.
    pub fn decay(&self, done: usize, best: Option<(usize, f32)>) -> Option<Range<usize>> {
        let n_steps = done as f64 * self.decay_share;
        let n_epochs = (n_steps / self.epoch_steps as f64).ceil() as usize;
        let is_next = n_steps > 0.0 && done as f64 + n_steps < self.steps as f64 && self.is_plateau(done, best);
        is_next.then(|| done..(done + n_epochs * self.epoch_steps).min(self.steps))
    }

    /// Last step of the training as known after `done` steps.
    pub fn end(&self, done: usize, best: Option<(usize, f32)>, decay: Option<&Range<usize>>) -> usize {
        match decay {
            Some(decay) => decay.end.min(self.steps),
            None if self.decay_share == 0.0 && self.is_plateau(done, best) => done.min(self.steps),
            None => self.steps,
        }
    }
}

/// Result of a step: its line of the log, and a short summary of the losses for the progress display.
pub struct StepReport {
    pub line: Value,
    pub summary: String,
}

/// A network in training with its data and its validation.
pub trait ValidatedTraining {
    type Validation: Serialize;

    /// Name of the speaker, and section of the configuration.
    fn names(&self) -> (&str, &'static str);
    fn schedule(&self) -> EpochSchedule;
    /// Whether the weights come from another training; `run` then validates them first, since a step may worsen them.
    fn is_pretrained(&self) -> bool {
        false
    }
    /// Number of completed steps.
    fn n_done(&self) -> usize;
    /// Step and score of the best validation so far.
    fn best(&mut self) -> &mut Option<(usize, f32)>;
    /// Steps of the decay of the learning rate that ends the training, once it has begun.
    fn decay(&self) -> Option<&Range<usize>> {
        None
    }
    /// Begins that decay; called only if the schedule has a `decay_share`.
    fn set_decay(&mut self, _decay: Range<usize>) {}
    /// Runs one optimiser step.
    ///
    /// # Errors
    /// A loss that is not finite or has exploded.
    fn step(&mut self) -> Result<StepReport>;
    fn validate(&self) -> Result<Self::Validation>;
    /// Score (lower is better), and a message if the network has collapsed.
    fn score_and_alarm(validation: &Self::Validation) -> (f64, Option<&str>);
    /// Short text with the main metrics of a validation.
    fn summary(validation: &Self::Validation) -> String;
    fn save(&mut self, folder: &Path) -> Result<()>;
    fn save_best(&self, folder: &Path, validation: &Self::Validation) -> Result<()>;
}

/// A validation that has been logged and whose checkpoint has been written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ValidatedStep {
    pub step: usize,
    /// Step of the best checkpoint so far.
    pub best_step: usize,
}

#[derive(Clone, Debug)]
pub struct TrainingOutcome<V> {
    /// Completed steps over all runs of this training.
    pub steps: usize,
    /// Step after which this run started.
    pub began_at: usize,
    /// Whether early stopping (`patience`) ended the training before its last step.
    pub stopped_early: bool,
    /// Number of training windows or segments.
    pub n_examples: usize,
    pub n_parameters: usize,
    /// Size of the vocabulary; 0 for networks without words.
    pub n_words: usize,
    /// Share of the step time spent waiting for the batch, 0..1; validation and checkpoints do not count.
    pub waiting: f64,
    pub validation: V,
    pub newest: PathBuf,
    /// Checkpoint with the best score.
    pub best: PathBuf,
    pub best_step: usize,
}

/// Trains to the last step, or until early stopping; `validated` is called after each validation. The caller fills in
/// `n_examples`, `n_parameters`, `n_words` and `waiting` of the outcome.
///
/// # Errors
/// Errors of a step, with the path of the last checkpoint; no step to run and no checkpoint; `StoppedTraining`.
pub fn run<T: ValidatedTraining>(
    training: &mut T,
    folder: &Path,
    progress: &dyn Progress,
    validated: &mut dyn FnMut(ValidatedStep),
) -> Result<TrainingOutcome<T::Validation>> {
    let schedule = training.schedule();
    let EpochSchedule { steps, epoch_steps, checkpoint_every, .. } = schedule;
    let section = training.names().1;
    let began_at = training.n_done();
    let mut log = MetricsLog::open(folder, began_at)?;
    let task = progress.begin(&format!("train {}", training.names().0), steps as u64);
    task.advance(began_at.min(steps) as u64);
    let mut progress_log = ProgressLog::new(began_at, steps);
    let (mut last, mut saved_at) = (None, began_at);
    if began_at == 0 && training.is_pretrained() {
        let validation = training.validate()?;
        log.write(&json!({ "step": 0, "epoch": 0, "validation": validation }))?;
        let score = T::score_and_alarm(&validation).0 as f32;
        progress.say(&format!("before the first step: {}, score {score:.3}", T::summary(&validation)));
        *training.best() = Some((0, score));
        training.save_best(folder, &validation)?;
    }
    while training.n_done() < end(training) {
        if progress.is_to_stop() {
            if training.n_done() > saved_at {
                training.save(folder)?;
            }
            return Err(stopped(training, folder)?.into());
        }
        let report = training.step().with_context(|| last_checkpoint(folder, section))?;
        let step = training.n_done();
        task.advance(1);
        if step.is_multiple_of(LOG_EVERY) {
            task.detail(&format!("{}  {:.2} steps/s", report.summary, progress_log.per_sec(step)));
            log.write(&report.line)?;
        }
        if let Some(line) = progress_log.line(step, &report.summary) {
            task.milestone(&line);
        }
        let is_last = step == end(training);
        let is_validated = step.is_multiple_of(epoch_steps) || is_last;
        if is_validated {
            let validation = training.validate()?;
            log.write(&json!({ "step": step, "epoch": step.div_ceil(epoch_steps), "validation": validation }))?;
            let (score, alarm) = T::score_and_alarm(&validation);
            // f32 values survive the round trip through the JSON of a checkpoint exactly.
            let score = score as f32;
            let previous_best = *training.best();
            let comparison = match previous_best {
                Some((best_step, best)) if best <= score => format!("best {best:.3} at step {best_step}"),
                _ => "new best".to_owned(),
            };
            progress.say(&format!("step {step}: {}, score {score:.3} ({comparison})", T::summary(&validation)));
            if let (Some(alarm), true) = (alarm, step > epoch_steps) {
                progress.say(&format!("step {step}: {alarm}"));
            }
            if previous_best.is_none_or(|(_, best)| score < best) {
                *training.best() = Some((step, score));
                training.save_best(folder, &validation)?;
            }
            if training.decay().is_none()
                && let Some(decay) = schedule.decay(step, *training.best())
            {
                let Range { start, end } = decay;
                progress.say(&format!("step {start}: no better score, the learning rate decays until step {end}"));
                training.set_decay(decay);
            }
            last = Some(validation);
        }
        if is_validated || step.is_multiple_of(checkpoint_every) {
            training.save(folder)?;
            saved_at = step;
        }
        if is_validated {
            let best_step = training.best().map_or(step, |(best_step, _)| best_step);
            validated(ValidatedStep { step, best_step });
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
    Ok(TrainingOutcome {
        steps: done,
        began_at,
        stopped_early: done < steps,
        n_examples: 0,
        n_parameters: 0,
        n_words: 0,
        waiting: 0.0,
        validation,
        newest,
        best: folder.join(BEST),
        best_step,
    })
}

/// Error that reports the checkpoints of a training stopped on request.
fn stopped(training: &mut impl ValidatedTraining, folder: &Path) -> Result<StoppedTraining> {
    let newest = checkpoint::list(folder)?.pop().map(|(_, path)| path);
    let best = training.best().map(|(step, _)| (step, folder.join(BEST)));
    Ok(StoppedTraining { step: training.n_done(), steps: training.schedule().steps, newest, best })
}

/// Last step of the training as known now.
fn end(training: &mut impl ValidatedTraining) -> usize {
    let (schedule, done, best) = (training.schedule(), training.n_done(), *training.best());
    schedule.end(done, best, training.decay())
}

/// Error of a training that was stopped on request before its last step. Started again, it resumes after `step`.
#[derive(Clone, Debug, thiserror::Error)]
#[error("stopped after step {step} of {steps}{}", self.checkpoint())]
pub struct StoppedTraining {
    pub step: usize,
    pub steps: usize,
    /// Checkpoint of this step; `None` if no step was completed.
    pub newest: Option<PathBuf>,
    /// Step and path of the best checkpoint so far; `None` before the first validation or if none is selected.
    pub best: Option<(usize, PathBuf)>,
}

impl StoppedTraining {
    fn checkpoint(&self) -> String {
        let Some(newest) = &self.newest else { return ", before the first checkpoint".to_owned() };
        format!("; the same command resumes from {}", newest.display())
    }
}
