//! Training of a speaker's generator against the motion discriminator. The same dataset, settings and seed give the
//! same checkpoints, even if the training was interrupted: the windows of a step depend only on the seed and the step,
//! and everything else is stored in the checkpoint. While a step runs, other threads read the batches of the next steps.

use super::prefetch::{BatchPrefetcher, prefetch};
use super::pretrained::PretrainedModel;
use super::recipe::{self, InitialWeights, TrainingMaterial};
use super::score::Validation;
use super::step::{GanTrainer, Losses, StepBatch, TrainerState};
use super::validate::ValidationIntervals;
use super::windows::{JoinedWindows, WindowLoader, needed};
use super::{augment, speakers, words};
use crate::generate::live::LOOK_AHEAD_SECS;
pub use crate::generate::model::BEST;
use crate::generate::model::SpeakerMetadata;
use crate::generate::normalisation::Normalisation;
use crate::train::epochs::{self, EpochSchedule, StepReport, TrainingOutcome, ValidatedStep, ValidatedTraining};
use crate::train::resume::{self, sample_windows};
use crate::train::word_vectors::WORD_DIM;
use crate::train::{log, no_window};
use anyhow::{Context, Result, ensure};
use candle_core::Device;
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir::{self, FolderLock};
use orator_base::text::counted;
use orator_dataset::config::{GanConfig, GanSettings};
use orator_dataset::{Dataset, Split};
use orator_formats::checkpoint;
use orator_formats::word_vectors::WordVectors;
use orator_nn::cpu::spin_pool::with_spinning_workers;
use orator_nn::gan::generator::FRAMES_MULTIPLE;
use orator_nn::weights::Contents;
use std::path::Path;
use std::time::{Duration, Instant};

/// Device of a training, and what a new training is initialised from.
pub struct TrainingStart<'a> {
    pub device: &'a Device,
    /// Checkpoint of another model, or folder of checkpoints; a resumed training ignores it.
    pub from: Option<&'a Path>,
    /// Vectors for the word embeddings; without them they are random.
    pub vectors: Option<&'a WordVectors>,
}

impl Default for TrainingStart<'_> {
    fn default() -> Self {
        Self { device: &Device::Cpu, from: None, vectors: None }
    }
}

/// Largest number of threads that read batches for a GPU.
const MAX_READERS: usize = 8;

/// Trains one speaker or several, a dataset each, until `requested.steps`, resuming from the newest checkpoint in
/// `folder` if there is one; then its settings apply, and differences are reported. Calls `validated` after each
/// validation, when its log line and checkpoint have been written.
///
/// # Errors
/// No window to train on; a checkpoint of another speaker or version; another training running in `folder`; a loss that
/// is not finite or explodes (the last good checkpoint is kept); `StoppedTraining` if `progress` requests a stop.
pub fn train(
    datasets: &[&Dataset],
    requested: &GanConfig,
    start: &TrainingStart,
    folder: &Path,
    progress: &dyn Progress,
    validated: &mut dyn FnMut(ValidatedStep),
) -> Result<TrainingOutcome<Validation>> {
    let TrainingStart { device, from, vectors } = *start;
    check(requested)?;
    ensure!(
        vectors.is_none() || requested.words,
        "gan.words is false, so the network does not read words: set gan.words = true, or omit --words"
    );
    speakers::check(datasets)?;
    // Shared lock: `generate` may load the model during training; `forget` may not remove it.
    let _model = FolderLock::shared(folder)?;
    let _lock = workdir::lock(folder)?;
    workdir::sweep_folder(folder, 0);
    let resumed = resume(datasets, requested, folder, progress)?;
    let pretrained_model = from.filter(|_| resumed.is_none()).map(PretrainedModel::read).transpose()?;
    if let Some(pretrained_model) = &pretrained_model {
        progress.say(&format!("initialising from {}", pretrained_model.description()));
    }
    let window_frames = resumed.as_ref().map_or(requested.window_frames, |(stored, _)| stored.settings.window_frames);
    // Checked before the statistics are read, which an empty split does not have.
    datasets.iter().try_for_each(|dataset| no_window::ensure_window(dataset, needed(window_frames)))?;
    let (settings, normals) = match &resumed {
        Some((stored, _)) => {
            (stored.settings.clone(), stored.speakers().into_iter().map(|of| of.normalisation).collect())
        }
        None => {
            let material = TrainingMaterial::measure(datasets, window_frames);
            let initial_weights = pretrained_model
                .as_ref()
                .map_or(InitialWeights::Random, |pretrained_model| pretrained_model.kind(datasets.len()));
            let settings = recipe::settings(requested, &material, initial_weights)?;
            let normal = |dataset: &&Dataset| speakers::normalisation_with_channels(dataset, &requested.channels);
            (settings, datasets.iter().map(normal).collect::<Result<Vec<_>>>()?)
        }
    };
    let words = match &resumed {
        Some((stored, _)) => stored.speaker.words.clone(),
        None => settings.words.then(|| words::vocabulary(datasets, vectors, progress)).transpose()?,
    };
    let vocabulary = words.as_ref().map(|words| &words.vocabulary);
    let normalised_datasets: Vec<(&Dataset, Normalisation)> = datasets.iter().copied().zip(normals).collect();
    let loaders: Vec<WindowLoader> = normalised_datasets
        .iter()
        .map(|(dataset, normal)| {
            let loader =
                WindowLoader::load(dataset, Split::Train, normal, settings.window_frames, settings.stride_frames)?;
            loader.with_look_ahead(speakers::look_ahead(&settings, dataset.info().fps)).with_words(vocabulary)
        })
        .collect::<Result<_>>()?;
    let n_windows: usize = loaders.iter().map(WindowLoader::len).sum();
    let dirs = datasets.iter().map(|dataset| dataset.dir().display().to_string()).collect::<Vec<_>>().join(", ");
    progress.say(&format!("{} of {dirs}; writing checkpoints to {}", counted(n_windows, "window"), folder.display()));
    let held_out = ValidationIntervals::load(&normalised_datasets, vocabulary, &settings, progress)?;
    let metadata = |((dataset, normal), loader): (&(&Dataset, Normalisation), &WindowLoader)| {
        let metadata = speakers::metadata(dataset, normal, loader, &settings, datasets.len())?;
        anyhow::Ok(metadata.with_words(words.clone(), vectors.map_or(WORD_DIM, WordVectors::dim)))
    };
    let speakers: Vec<SpeakerMetadata> = match &resumed {
        Some((stored, _)) => stored.speakers(),
        None => normalised_datasets.iter().zip(&loaders).map(metadata).collect::<Result<_>>()?,
    };
    let loader = JoinedWindows::new(loaders);
    let mut trainer = match &pretrained_model {
        None => GanTrainer::new(speakers, settings, device)?,
        Some(pretrained_model) => pretrained_model.trainer(speakers, settings, vectors, &loader, device)?,
    };
    if resumed.is_none() && pretrained_model.is_none() {
        trainer.initialise_words(vectors)?;
    }
    if let Some((stored, contents)) = &resumed {
        trainer.load(stored, contents)?;
        // A process killed before removing the oldest checkpoint leaves one too many.
        checkpoint::prune(folder, trainer.settings.keep_checkpoints)?;
    }
    if resumed.is_none() {
        let material = TrainingMaterial::measure(datasets, window_frames);
        report_settings(&trainer, &loader, &material, pretrained_model.is_some(), progress)?;
    }
    let (settings, network, device) =
        (trainer.settings.clone(), trainer.speakers.network().clone(), trainer.device().clone());
    let batch = |step: usize| {
        let which = sample_windows(settings.seed, step, settings.batch, loader.len());
        let windows = loader.batch_changed(&which, &augment::changes(&settings, step, loader.fps()))?;
        let batch = StepBatch::draw(&windows, &settings, &network, step, &device)?;
        // The copies to a GPU are complete when another thread uses them.
        device.synchronize()?;
        Ok(batch)
    };
    // On the CPU all threads but one are busy with the steps; a GPU leaves them idle.
    let n_readers = if device.is_cpu() { 1 } else { rayon::current_num_threads().min(MAX_READERS) };
    let (outcome, waiting) = prefetch(settings.steps, n_readers, &batch, |batches| {
        let mut training = GanTraining {
            names: trainer.speakers.names(),
            is_pretrained: pretrained_model.is_some(),
            trainer: &mut trainer,
            batches,
            held_out: &held_out,
            last: None,
            stepping: Duration::ZERO,
            waiting: Duration::ZERO,
        };
        let mut run = || epochs::run(&mut training, folder, progress, validated);
        let outcome = if device.is_cpu() { with_spinning_workers(run) } else { run() }?;
        Ok((outcome, training.waiting.as_secs_f64() / training.stepping.as_secs_f64().max(1e-9)))
    })?;
    Ok(TrainingOutcome { n_examples: loader.len(), n_parameters: trainer.n_parameters(), waiting, ..outcome })
}

/// Reports the settings of a new training, and warnings about little material.
fn report_settings(
    trainer: &GanTrainer,
    loader: &JoinedWindows,
    material: &TrainingMaterial,
    is_pretrained: bool,
    progress: &dyn Progress,
) -> Result<()> {
    if let Some(warning) = recipe::mean_pose_warning(material).filter(|_| !is_pretrained) {
        progress.say(&warning);
    }
    let secs_a_step = secs_a_step(trainer, loader)?;
    recipe::lines(&trainer.settings, material, secs_a_step)?.iter().for_each(|line| progress.say(line));
    let few = no_window::motion_warning(material.train_secs).filter(|_| !is_pretrained);
    few.iter().for_each(|warning| progress.say(warning));
    Ok(())
}

/// Seconds per step on this machine, measured on a temporary copy of the networks; `None` for trainings of few steps.
fn secs_a_step(trainer: &GanTrainer, loader: &JoinedWindows) -> Result<Option<f64>> {
    const MIN_STEPS: usize = 100;
    if trainer.settings.steps < MIN_STEPS {
        return Ok(None);
    }
    let mut trial = GanTrainer::new(trainer.speakers.all().to_vec(), trainer.settings.clone(), trainer.device())?;
    let which = sample_windows(trial.settings.seed, 0, trial.settings.batch, loader.len());
    let batch = loader.batch_changed(&which, &[])?;
    let is_cpu = trial.device().is_cpu();
    let mut measure = || {
        trial.step(&batch)?;
        let start = Instant::now();
        trial.step(&batch)?;
        trial.step(&batch)?;
        Ok(Some(start.elapsed().as_secs_f64() / 2.0))
    };
    if is_cpu { with_spinning_workers(measure) } else { measure() }
}

struct GanTraining<'a, 'b, 'c> {
    names: String,
    /// Whether the training was initialised from another model in this run.
    is_pretrained: bool,
    trainer: &'a mut GanTrainer,
    batches: &'a mut BatchPrefetcher<'b, 'c, StepBatch>,
    held_out: &'a ValidationIntervals,
    /// Last losses that were read.
    last: Option<Losses>,
    /// Total time of the steps, including the wait for their batches.
    stepping: Duration,
    waiting: Duration,
}

impl GanTraining<'_, '_, '_> {
    /// Reads the losses of the steps since the last call, and checks that the training has not diverged.
    fn read_losses(&mut self) -> Result<()> {
        for (step, losses) in self.trainer.take_losses()? {
            resume::ensure_not_diverged(step, &losses.named(), losses.gradient_norm)?;
            self.last = Some(losses);
        }
        Ok(())
    }
}

impl ValidatedTraining for GanTraining<'_, '_, '_> {
    type Validation = Validation;

    fn names(&self) -> (&str, &'static str) {
        (&self.names, "gan")
    }

    fn schedule(&self) -> EpochSchedule {
        let GanSettings { steps, epoch_steps, checkpoint_every, patience, .. } = self.trainer.settings;
        EpochSchedule { steps, epoch_steps, checkpoint_every, patience }
    }

    fn is_pretrained(&self) -> bool {
        self.is_pretrained
    }

    fn n_done(&self) -> usize {
        self.trainer.step
    }

    fn best(&mut self) -> &mut Option<(usize, f32)> {
        &mut self.trainer.best
    }

    fn step(&mut self) -> Result<StepReport> {
        let before = Instant::now();
        let batch = self.batches.take(self.trainer.step)?;
        self.waiting += before.elapsed();
        self.trainer.advance(&batch, &mut |_| ())?;
        let (step, schedule) = (self.trainer.step, self.schedule());
        let read_every = [epochs::LOG_EVERY, schedule.epoch_steps, schedule.checkpoint_every, schedule.steps];
        if self.trainer.device().is_cpu() || self.last.is_none() || read_every.iter().any(|n| step.is_multiple_of(*n)) {
            self.read_losses()?;
        }
        self.stepping += before.elapsed();
        let losses = self.last.context("a step without losses")?;
        let Losses { l1, adversarial, discriminator, .. } = losses;
        let summary = format!("L1 {l1:.3} adv {adversarial:.3} D {discriminator:.3}");
        Ok(StepReport { line: log::line(step, &losses), summary })
    }

    fn validate(&self) -> Result<Validation> {
        self.held_out.validate(self.trainer)
    }

    fn score_and_alarm(validation: &Validation) -> (f64, Option<&str>) {
        (validation.score, validation.alarm.as_deref())
    }

    fn summary(validation: &Validation) -> String {
        validation.summary()
    }

    fn save(&mut self, folder: &Path) -> Result<()> {
        // On a GPU, the losses of the last steps may not have been read.
        self.read_losses()?;
        self.trainer.save(folder)
    }

    fn save_best(&self, folder: &Path, validation: &Validation) -> Result<()> {
        self.trainer.save_best(folder, validation)
    }
}

/// Newest checkpoint and its state, with the settings of the resumed training. Reports where these differ from
/// `requested`.
fn resume(
    datasets: &[&Dataset],
    requested: &GanConfig,
    folder: &Path,
    progress: &dyn Progress,
) -> Result<Option<(TrainerState, Contents)>> {
    resume::newest(folder, progress, |contents| {
        let mut stored = TrainerState::from_checkpoint(contents)?;
        let (settings, mut differences) = stored.settings(requested)?;
        stored.settings = settings;
        let n_stored = 1 + stored.other_speakers.len();
        ensure!(
            n_stored == datasets.len(),
            "it has {n_stored} speakers, this training {}; choose another --out",
            datasets.len()
        );
        let speakers = std::iter::once(&mut stored.speaker).chain(&mut stored.other_speakers);
        for (metadata, dataset) in speakers.zip(datasets) {
            speakers::resume(metadata, dataset, &mut differences)?;
        }
        Ok((stored, differences))
    })
}

fn check(settings: &GanConfig) -> Result<()> {
    ensure!(
        settings.window_frames >= FRAMES_MULTIPLE,
        "gan.window_frames is {}: expected at least {FRAMES_MULTIPLE}",
        settings.window_frames
    );
    let secs = settings.look_ahead_secs;
    ensure!(
        secs == 0.0 || secs >= LOOK_AHEAD_SECS[0],
        "gan.look_ahead_secs is {secs}: expected {} to {}, or 0 for a network that reads the whole speech",
        LOOK_AHEAD_SECS[0],
        LOOK_AHEAD_SECS[1]
    );
    ensure!(
        secs == 0.0 || !settings.words,
        "gan.words is true, but a network with gan.look_ahead_secs reads no words, which are not known in time: set one of \
         the two to its default"
    );
    if let Some(batch) = settings.batch.given() {
        ensure!(batch > 1, "gan.batch is {batch}: expected at least 2 (for batch norm)");
    }
    ensure!(
        settings.checkpoint_every > 0 && settings.epoch_steps.given() != Some(0) && settings.stride_frames > 0,
        "gan.checkpoint_every, gan.epoch_steps and gan.stride_frames must be at least 1"
    );
    Ok(())
}
