//! Parts shared by `orator train gan` and `orator train seq2seq`: folders of a training, and its page during training.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, bail};
use orator_base::stage::progress::Progress as _;
use orator_base::stage::workdir::BusyFolder;
use orator_base::types::file_name::FileName;
use orator_base::types::time::FrameRate;
use orator_dataset::config::Config;
use orator_dataset::index::SampleRef;
use orator_dataset::{Dataset, Split};
use orator_gesture::train::epochs::{StoppedTraining, ValidatedStep};
use orator_report::training::live::{BestPosesFn, LivePage};
use serde_json::{Value, json};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Name that stands for all speakers of the configuration, unless a speaker has this name.
pub(super) const ALL: &str = "all";
/// Number of intervals on the page of a training, and duration generated for each.
const N_PAIRS: usize = 3;
const PAIR_SECS: f64 = 8.0;

/// Folders of a training as given on the command line.
pub(super) struct TrainingFolders<'a> {
    pub config: &'a Config,
    pub speaker: Option<&'a String>,
    pub dataset: Option<&'a PathBuf>,
    pub out: Option<&'a PathBuf>,
}

impl TrainingFolders<'_> {
    /// Opens the datasets of several speakers; returns them with the output folder, by default `work/NETWORK/all`.
    pub(super) fn open_several(&self, network: &str, datasets: &[PathBuf]) -> Result<(Vec<Dataset>, PathBuf)> {
        let work = &self.config.settings.work.dir;
        let folders: Vec<PathBuf> = match datasets {
            [] => self.config.settings.speaker.iter().map(|of| work.join("dataset").join(&of.name)).collect(),
            given => given.to_vec(),
        };
        let open =
            |folder: &PathBuf| Dataset::open(folder).context("cannot open the datasets; create them with `orator run`");
        let out = self.out.cloned().unwrap_or_else(|| work.join(network).join(ALL));
        Ok((folders.iter().map(open).collect::<Result<_>>()?, out))
    }

    /// Opens the dataset; returns it with the output folder, by default `work/NETWORK/SPEAKER`. A dataset given without
    /// a speaker determines the speaker.
    pub(super) fn open(&self, network: &str) -> Result<(Dataset, PathBuf)> {
        let work = &self.config.settings.work.dir;
        let named = match self.dataset {
            Some(_) => self.speaker.cloned(),
            None => Some(speaker(self.speaker, self.config)?),
        };
        let folder = match (self.dataset, &named) {
            (Some(folder), _) => folder.clone(),
            (None, name) => work.join("dataset").join(name.as_deref().unwrap_or_default()),
        };
        let dataset = Dataset::open(&folder).context("cannot open the dataset; create it with `orator run`")?;
        let out = match self.out {
            Some(out) => out.clone(),
            None => {
                let name = FileName::new(named.unwrap_or_else(|| dataset.info().speaker.clone()));
                work.join(network).join(&*name.context("the speaker name is not a valid folder name; give --out")?)
            }
        };
        Ok((dataset, out))
    }
}

/// The speaker's name: the given one, or the only configured one.
fn speaker(given: Option<&String>, config: &Config) -> Result<String> {
    let names: Vec<&str> = config.settings.speaker.iter().map(|speaker| speaker.name.as_str()).collect();
    match (given, names.as_slice()) {
        (Some(name), _) if names.contains(&name.as_str()) => Ok(name.clone()),
        (Some(name), _) => {
            bail!("no speaker {name:?} in {}; its speakers are {}", config.file.display(), names.join(", "))
        }
        (None, [only]) => Ok((*only).to_owned()),
        (None, []) => bail!("{} has no speaker; give --dataset", config.file.display()),
        (None, _) => bail!("several speakers are configured; select one with --speaker: {}", names.join(", ")),
    }
}

/// Result of a completed training.
pub struct TrainedModel {
    pub text: String,
    pub next: String,
    pub facts: Value,
    /// Whether its page could be written.
    pub has_page: bool,
}

impl TrainedModel {
    /// Prints the result.
    pub(super) fn report(self, ui: &Ui) -> Outcome {
        ui.summary(&self.text, Some(&self.next), self.facts);
        if self.has_page { Outcome::Done } else { Outcome::SomeFailed }
    }
}

/// Results of several trainings.
pub struct TrainedModels {
    pub text: String,
    /// Command to type next: that of the first model.
    pub next: Option<String>,
    pub facts: Vec<Value>,
    pub outcome: Outcome,
}

impl TrainedModels {
    /// Prints the results.
    pub(super) fn report(self, ui: &Ui) -> Outcome {
        ui.summary(&self.text, self.next.as_deref(), json!({ "speakers": self.facts, "next": self.next }));
        self.outcome
    }
}

/// Trains a model for each speaker of the configuration by `train_one`. Speakers that another process trains are
/// skipped; a failure does not stop the others.
///
/// # Errors
/// A training that was stopped on request.
pub fn train_all(
    config: &Config,
    ui: &Ui,
    train_one: impl Fn(&String) -> Result<TrainedModel>,
) -> Result<TrainedModels> {
    let (mut text, mut facts, mut next, mut n_failed) = (String::new(), Vec::new(), None, 0);
    let mut outcome = None;
    for speaker in config.settings.speaker.iter().map(|speaker| &speaker.name) {
        if ui.is_to_stop() {
            text += &format!("{speaker}: not trained: stopped on request\n");
            outcome = Some(Outcome::Stopped);
            continue;
        }
        match train_one(speaker) {
            Ok(trained) => {
                text += &format!("{}\n", trained.text);
                n_failed += usize::from(!trained.has_page);
                facts.push(trained.facts);
                next.get_or_insert(trained.next);
            }
            Err(error) if error.is::<StoppedTraining>() => return Err(error),
            Err(error) => {
                let is_busy = error.is::<BusyFolder>();
                n_failed += usize::from(!is_busy);
                let word = if is_busy { "skipped" } else { "failed" };
                text += &format!("{speaker}: {word}: {error:#}\n");
                facts.push(json!({ "speaker": speaker, "busy": is_busy, "error": format!("{error:#}") }));
            }
        }
    }
    let outcome = outcome.unwrap_or(if n_failed == 0 { Outcome::Done } else { Outcome::SomeFailed });
    Ok(TrainedModels { text, next, facts, outcome })
}

/// Steps per second of a call that trained from step `began_at` to `steps` in `secs`, as text and number.
pub(super) fn speed(began_at: usize, steps: usize, secs: f64) -> (String, f64) {
    let per_sec = (steps - began_at) as f64 / secs.max(1e-9);
    let text = if steps == began_at { "no step left to train".to_owned() } else { format!("{per_sec:.2} steps/s") };
    (text, per_sec)
}

/// The page of a training. Failing to write it is reported once and does not stop the training.
pub(super) struct TrainingPage<'a> {
    page: LivePage<'a>,
    ui: &'a Ui,
    has_reported: bool,
}

impl<'a> TrainingPage<'a> {
    pub(super) fn new(folder: &'a Path, speaker: String, poses: BestPosesFn<'a>, ui: &'a Ui) -> Self {
        Self { page: LivePage::new(folder, speaker, poses), ui, has_reported: false }
    }

    /// Updates the page after a validation.
    pub(super) fn update(&mut self, at: ValidatedStep) {
        if let Err(error) = self.page.write(at)
            && !self.has_reported
        {
            self.has_reported = true;
            self.ui.say(&format!("cannot write the training page yet: {error:#}"));
        }
    }

    /// Writes the page of a completed training; `None` if that failed.
    pub(super) fn finish(mut self, at: ValidatedStep) -> Option<PathBuf> {
        let written = self.page.write(at).inspect_err(|error| {
            self.ui.say(&format!("cannot write the training page: {error:#}"));
        });
        written.ok().map(|()| self.page.path())
    }
}

/// A few intervals that were not trained on, or of the training split if there are no others.
pub(super) fn page_samples(dataset: &Dataset) -> Vec<SampleRef> {
    let splits = [Split::Validation, Split::Train].map(|split| dataset.samples(split));
    let samples = splits.into_iter().find(|samples| !samples.is_empty()).unwrap_or_default();
    let n = samples.len().min(N_PAIRS);
    (0..n).map(|i| samples[i * samples.len() / n].clone()).collect()
}

/// Range of up to `PAIR_SECS` in the middle of `n_frames` frames.
pub(super) fn middle(n_frames: usize, fps: FrameRate) -> Range<usize> {
    let span = ((PAIR_SECS * fps.per_sec()) as usize).min(n_frames);
    let first = (n_frames - span) / 2;
    first..first + span
}
