//! The loop of a training whose best step is chosen by validation: steps, at the end of each epoch a validation,
//! checkpoints on the way. Who asks for an end gets it after the step at hand, with a checkpoint.

use super::log::MetricsLog;
use super::pace::TrainingPace;
use super::resume::kept;
use crate::generate::model::BEST;
use anyhow::{Context, Result, bail};
use orator_base::stage::progress::Progress;
use orator_formats::checkpoint;
use serde::Serialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

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
    /// Whether it begins with what another training learnt, so that its first step may make it worse.
    fn has_learnt(&self) -> bool {
        false
    }
    /// Steps done.
    fn n_done(&self) -> usize;
    /// Step and score of the best validation so far.
    fn best(&mut self) -> &mut Option<(usize, f32)>;
    /// One step. Errors when a loss is not finite or has exploded.
    fn step(&mut self) -> Result<StepReport>;
    fn validate(&self) -> Result<Self::Validation>;
    /// The score, lower is better, and why the network has collapsed, if it has.
    fn judged(validation: &Self::Validation) -> (f64, Option<&str>);
    /// A validation's figures in a few words.
    fn words(validation: &Self::Validation) -> String;
    fn save(&self, folder: &Path) -> Result<()>;
    fn save_best(&self, folder: &Path, validation: &Self::Validation) -> Result<()>;
}

/// A validation that is logged, behind it a checkpoint that is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ValidatedStep {
    pub step: usize,
    /// Step of the best checkpoint so far.
    pub best_step: usize,
}

/// How a training ended.
#[derive(Clone, Debug)]
pub struct TrainingOutcome<V> {
    /// Steps of this training altogether, and the step this run began at.
    pub steps: usize,
    pub began_at: usize,
    /// Whether it ended before its last step since the score had not become better for as many epochs as its patience.
    pub stopped_early: bool,
    /// Windows or segments that were trained on.
    pub n_examples: usize,
    pub n_parameters: usize,
    /// Words that were trained with.
    pub n_words: usize,
    /// Share of the time of the steps that they waited for their batch, 0..1; validation and checkpoints do not count.
    pub waiting: f64,
    /// Of the newest checkpoint.
    pub validation: V,
    pub newest: PathBuf,
    /// Best by the validation's score.
    pub best: PathBuf,
    pub best_step: usize,
}

/// Trains to the last step, or until the score no longer becomes better; `validated` is called after each validation. The
/// outcome has no examples, parameters, words and waiting yet.
/// Errors: those of a step, with the checkpoint that is kept; no step to do and no checkpoint; `StoppedTraining`.
pub fn run<T: ValidatedTraining>(
    training: &mut T,
    folder: &Path,
    progress: &dyn Progress,
    validated: &mut dyn FnMut(ValidatedStep),
) -> Result<TrainingOutcome<T::Validation>> {
    let EpochSchedule { steps, epoch_steps, checkpoint_every, .. } = training.schedule();
    let section = training.names().1;
    let began_at = training.n_done();
    let mut log = MetricsLog::open(folder, began_at)?;
    let task = progress.begin(&format!("train {}", training.names().0), steps as u64);
    task.advance(began_at.min(steps) as u64);
    let mut pace = TrainingPace::new(began_at, steps);
    let (mut last, mut saved_at) = (None, began_at);
    if began_at == 0 && training.has_learnt() {
        let validation = training.validate()?;
        log.write(&json!({ "step": 0, "epoch": 0, "validation": validation }))?;
        let score = T::judged(&validation).0 as f32;
        progress.say(&format!("before the first step: {}, score {score:.3}", T::words(&validation)));
        *training.best() = Some((0, score));
        training.save_best(folder, &validation)?;
    }
    while training.n_done() < steps && !is_over(training) {
        if progress.is_to_stop() {
            if training.n_done() > saved_at {
                training.save(folder)?;
            }
            return Err(stopped(training, folder)?.into());
        }
        let report = training.step().with_context(|| kept(folder, section))?;
        let step = training.n_done();
        task.advance(1);
        if step.is_multiple_of(LOG_EVERY) {
            task.detail(&format!("{}  {:.2} steps/s", report.words, pace.per_sec(step)));
            log.write(&report.line)?;
        }
        if let Some(line) = pace.line(step, &report.words) {
            task.milestone(&line);
        }
        let is_last = step == steps;
        let is_validated = step.is_multiple_of(epoch_steps) || is_last;
        if is_validated {
            let validation = training.validate()?;
            log.write(&json!({ "step": step, "epoch": step.div_ceil(epoch_steps), "validation": validation }))?;
            let (score, alarm) = T::judged(&validation);
            // In f32, whose decimals come back exactly from JSON.
            let score = score as f32;
            let before = *training.best();
            let standing = match before {
                Some((best_step, best)) if best <= score => format!("best {best:.3} at step {best_step}"),
                _ => "the best so far".to_owned(),
            };
            progress.say(&format!("step {step}: {}, score {score:.3} ({standing})", T::words(&validation)));
            if let (Some(alarm), true) = (alarm, step > epoch_steps) {
                progress.say(&format!("step {step}: {alarm}"));
            }
            if before.is_none_or(|(_, best)| score < best) {
                *training.best() = Some((step, score));
                training.save_best(folder, &validation)?;
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

/// What is kept of a training that ends here.
fn stopped(training: &mut impl ValidatedTraining, folder: &Path) -> Result<StoppedTraining> {
    let newest = checkpoint::list(folder)?.pop().map(|(_, path)| path);
    let best = training.best().map(|(step, _)| (step, folder.join(BEST)));
    Ok(StoppedTraining { step: training.n_done(), steps: training.schedule().steps, newest, best })
}

/// Whether the score has not become better for as many epochs as the patience allows.
fn is_over(training: &mut impl ValidatedTraining) -> bool {
    let EpochSchedule { patience, epoch_steps, .. } = training.schedule();
    let done = training.n_done();
    let since = done - training.best().map_or(done, |(step, _)| step.min(done));
    patience > 0 && since >= patience * epoch_steps
}

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
