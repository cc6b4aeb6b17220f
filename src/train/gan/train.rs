//! Training a speaker's generator against the motion discriminator. The same dataset, settings and
//! seed give the same checkpoints, also when the training was interrupted: the windows of a step depend on the seed
//! and the step alone (the place of the loader is the step), everything else is in the checkpoint.

use super::augment;
use super::recipe::account;
use super::recipe::material::TrainingMaterial;
use super::recipe::settings::GanSettings;
use super::score::Validation;
use super::start::{self, StartingModel};
use super::step::{GanTrainer, Losses, TrainerState};
use super::validate::ValidationIntervals;
use super::windows::{WindowLoader, needed};
use crate::config::GanConfig;
use crate::config::{ComputeDevice, MotionRepresentation, NetworkPreset};
use crate::dataset::{Dataset, Split};
use crate::formats::checkpoint;
use crate::formats::checkpoint::Contents;
pub use crate::generate::model::BEST;
use crate::generate::model::SpeakerMetadata;
use crate::generate::normalisation::{ChannelNormalisation, Normalisation};
use crate::generate::representation::Representation;
use crate::motion::bones;
use crate::nn::cpu::thread_team::with_spinning_workers;
use crate::nn::device;
use crate::nn::gan::generator::Preset;
use crate::nn::gan::generator::{Config, FRAMES_MULTIPLE};
use crate::stage::progress::Progress;
use crate::stage::workdir::{self, FolderLock};
use crate::train::epochs::{self, EpochSchedule, StepReport, ValidatedStep, ValidatedTraining};
use crate::train::no_window;
use crate::train::resume::{self, sample_windows};
use crate::types::posture::PostureChannel;
use crate::types::skeleton::N_BONES;
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How a training ended.
#[derive(Clone, Debug)]
pub struct TrainingOutcome {
    /// Steps of this training altogether, and the step this run began at.
    pub steps: usize,
    pub began_at: usize,
    /// Whether it ended before its last step since the score had not become better for `gan.patience` epochs.
    pub stopped_early: bool,
    pub n_windows: usize,
    pub n_parameters: usize,
    /// Of the newest checkpoint.
    pub validation: Validation,
    pub newest: PathBuf,
    /// Best by the validation's score.
    pub best: PathBuf,
    pub best_step: usize,
    /// Share of the time of the steps that they waited for their batch, 0..1; validation and checkpoints do not count.
    pub waiting: f64,
}

/// Trains on `dataset` until `wanted.steps`, going on from the newest checkpoint in `folder`; what the settings of that
/// checkpoint say counts, and differences are reported.
///
/// # Errors
/// No window to train on; a checkpoint of another speaker or version; another training at work in `folder`; a loss that
/// is not finite or explodes (the last good checkpoint stays); `StoppedTraining` where `progress` asks for an end.
pub fn train(
    dataset: &Dataset,
    requested: &GanConfig,
    folder: &Path,
    progress: &dyn Progress,
) -> Result<TrainingOutcome> {
    train_watched(dataset, requested, None, folder, progress, &mut |_| ())
}

/// [`train`], with a call behind each validation, when log and checkpoints are written. `from`: the checkpoint of another
/// speaker, or its folder, that a training begins with; one that goes on has begun.
pub fn train_watched(
    dataset: &Dataset,
    requested: &GanConfig,
    from: Option<&Path>,
    folder: &Path,
    progress: &dyn Progress,
    validated: &mut dyn FnMut(ValidatedStep),
) -> Result<TrainingOutcome> {
    check(requested)?;
    ensure!(
        !dataset.info().no_sound,
        "{} was imported without sound, so that there is no speech to learn from; import it with its sound files",
        dataset.dir().display()
    );
    // Others may listen to the model while it learns, and nobody may forget it.
    let _model = FolderLock::shared(folder)?;
    let _lock = workdir::lock(folder)?;
    let resumed = resume(dataset, requested, folder, progress)?;
    let start = from.filter(|_| resumed.is_none()).map(StartingModel::read).transpose()?;
    if let Some(start) = &start {
        progress.say(&format!("beginning with {}", start.account()));
    }
    let window_frames = resumed.as_ref().map_or(requested.window_frames, |(stored, _)| stored.settings.window_frames);
    // Before the statistics, of which an empty split has none.
    no_window::ensure_window(dataset, needed(window_frames))?;
    let (settings, normal) = match &resumed {
        Some((stored, _)) => (stored.settings.clone(), stored.speaker.normalisation.clone()),
        None => {
            let channels = channels(dataset, &requested.channels)?;
            let material = TrainingMaterial::measure(dataset, window_frames);
            let settings = GanSettings::new(requested, &material, start.is_some());
            (settings, Normalisation { channels, ..normalisation(dataset)? })
        }
    };
    let loader = WindowLoader::load(dataset, Split::Train, &normal, settings.window_frames, settings.stride_frames)?;
    let place = dataset.dir().display();
    progress.say(&format!("{} windows of {place}; what is learnt goes to {}", loader.len(), folder.display()));
    let held_out = ValidationIntervals::load(dataset, &settings, &normal, progress)?;
    let mut trainer = match &resumed {
        Some((stored, _)) => GanTrainer::new(stored.speaker.clone(), settings)?,
        None => {
            let representation = match settings.representation {
                MotionRepresentation::Positions => Representation::Positions,
                MotionRepresentation::Bones => Representation::bones(&normal, loader.poses()),
            };
            let network = Config::from_preset(preset(settings.preset), normal.n_numbers());
            let (info, hash) = (dataset.info(), dataset.hash()?);
            let mut metadata = SpeakerMetadata::new(&info.speaker, info.fps, &hash, network, normal, representation);
            metadata.videos = start::videos(dataset);
            match &start {
                None => GanTrainer::new(metadata, settings)?,
                Some(start) => start.begin(metadata, settings)?,
            }
        }
    };
    if let Some((stored, contents)) = &resumed {
        trainer.load(stored, contents)?;
        // One too many is left by a kill before the oldest was removed.
        checkpoint::prune(folder, trainer.settings.keep_checkpoints)?;
    }
    if resumed.is_none() {
        let material = TrainingMaterial::measure(dataset, window_frames);
        let secs_a_step = secs_a_step(&trainer, &loader)?;
        account::lines(&trainer.settings, &material, secs_a_step).iter().for_each(|line| progress.say(line));
    }
    let mut training = GanTraining {
        trainer: &mut trainer,
        loader: &loader,
        held_out: &held_out,
        stepping: Duration::ZERO,
        waiting: Duration::ZERO,
    };
    let end = with_spinning_workers(|| epochs::run(&mut training, folder, progress, validated))?;
    let waiting = training.waiting.as_secs_f64() / training.stepping.as_secs_f64().max(1e-9);
    Ok(TrainingOutcome {
        steps: trainer.step,
        began_at: end.began_at,
        stopped_early: end.stopped_early,
        n_windows: loader.len(),
        n_parameters: trainer.n_parameters(),
        validation: end.validation,
        newest: end.newest,
        best: folder.join(BEST),
        best_step: end.best_step,
        waiting,
    })
}

/// Seconds of a step on this machine, measured on networks that are dropped; `None` of a training of few steps.
fn secs_a_step(trainer: &GanTrainer, loader: &WindowLoader) -> Result<Option<f64>> {
    const FEW: usize = 100;
    if trainer.settings.steps < FEW {
        return Ok(None);
    }
    let mut trial = GanTrainer::new(trainer.metadata.clone(), trainer.settings.clone())?;
    let batch = loader.batch(&sample_windows(trial.settings.seed, 0, trial.settings.batch, loader.len()))?;
    with_spinning_workers(|| {
        trial.step(&batch)?;
        let start = Instant::now();
        trial.step(&batch)?;
        trial.step(&batch)?;
        Ok(Some(start.elapsed().as_secs_f64() / 2.0))
    })
}

/// A trainer with its windows.
struct GanTraining<'a> {
    trainer: &'a mut GanTrainer,
    loader: &'a WindowLoader,
    held_out: &'a ValidationIntervals,
    /// Time of the steps, and of it until their batches were there.
    stepping: Duration,
    waiting: Duration,
}

impl ValidatedTraining for GanTraining<'_> {
    type Validation = Validation;

    fn names(&self) -> (&str, &'static str) {
        (&self.trainer.metadata.name, "gan")
    }

    fn schedule(&self) -> EpochSchedule {
        let GanSettings { steps, epoch_steps, checkpoint_every, patience, .. } = self.trainer.settings;
        EpochSchedule { steps, epoch_steps, checkpoint_every, patience }
    }

    fn n_done(&self) -> usize {
        self.trainer.step
    }

    fn best(&mut self) -> &mut Option<(usize, f32)> {
        &mut self.trainer.best
    }

    fn step(&mut self) -> Result<StepReport> {
        let GanSettings { seed, batch, .. } = self.trainer.settings;
        let before = Instant::now();
        let step = self.trainer.step;
        let which = sample_windows(seed, step, batch, self.loader.len());
        let changes = augment::changes(&self.trainer.settings, step, self.loader.fps());
        let batch = self.loader.batch_changed(&which, &changes)?;
        self.waiting += before.elapsed();
        let losses = self.trainer.step(&batch)?;
        self.stepping += before.elapsed();
        losses.check(self.trainer.step)?;
        let Losses { l1, adversarial, discriminator, .. } = losses;
        let words = format!("L1 {l1:.3} adv {adversarial:.3} D {discriminator:.3}");
        Ok(StepReport { line: losses.line(self.trainer.step), words })
    }

    fn validate(&self) -> Result<Validation> {
        self.held_out.validate(self.trainer)
    }

    fn judged(validation: &Validation) -> (f64, Option<&str>) {
        (validation.score, validation.alarm.as_deref())
    }

    fn words(validation: &Validation) -> String {
        validation.words()
    }

    fn save(&self, folder: &Path) -> Result<()> {
        self.trainer.save(folder)
    }

    fn save_best(&self, folder: &Path, validation: &Validation) -> Result<()> {
        self.trainer.save_best(folder, validation)
    }
}

/// The newest checkpoint, and what it says with the settings that count now. Tells where these differ from `requested`.
fn resume(
    dataset: &Dataset,
    requested: &GanConfig,
    folder: &Path,
    progress: &dyn Progress,
) -> Result<Option<(TrainerState, Contents)>> {
    resume::newest(folder, progress, |contents| {
        let mut stored = TrainerState::from_checkpoint(contents)?;
        let (settings, mut differences) = stored.settings(requested)?;
        stored.settings = settings;
        let (info, metadata) = (dataset.info(), &mut stored.speaker);
        ensure!(
            metadata.name == info.speaker && metadata.fps == info.fps,
            "it is of {} at {}, the dataset of {} at {}; choose another --out",
            metadata.name,
            metadata.fps,
            info.speaker,
            info.fps
        );
        let hash = dataset.hash()?;
        if metadata.dataset != hash {
            differences.push(
                "the dataset is another now: its windows are trained on, with the checkpoint's mean, deviation and bones"
                    .to_owned(),
            );
            metadata.dataset = hash;
            metadata.videos.extend(start::videos(dataset));
            metadata.videos.sort();
            metadata.videos.dedup();
        }
        Ok((stored, differences))
    })
}

/// The network of a preset of the configuration.
pub const fn preset(preset: NetworkPreset) -> Preset {
    match preset {
        NetworkPreset::Light => Preset::Light,
        NetworkPreset::Paper => Preset::Paper,
    }
}

fn check(settings: &GanConfig) -> Result<()> {
    ensure!(
        settings.window_frames > 0 && settings.window_frames.is_multiple_of(FRAMES_MULTIPLE),
        "gan.window_frames is {}: it must be a multiple of {FRAMES_MULTIPLE}",
        settings.window_frames
    );
    if let Some(batch) = settings.batch.given() {
        ensure!(batch > 1, "gan.batch is {batch}: batch norm needs at least 2 windows");
    }
    ensure!(
        settings.checkpoint_every > 0 && settings.epoch_steps.given() != Some(0) && settings.stride_frames > 0,
        "gan.checkpoint_every, gan.epoch_steps and gan.stride_frames must be at least 1"
    );
    device::open(settings.device == ComputeDevice::Cuda)?;
    Ok(())
}

/// Statistics of the channels that are to be learnt.
fn channels(dataset: &Dataset, wanted: &[PostureChannel]) -> Result<Vec<ChannelNormalisation>> {
    let posture = dataset.stats().posture.as_ref();
    let of = |channel: PostureChannel| -> Result<ChannelNormalisation> {
        let stats = posture.and_then(|posture| posture.get(&channel)).filter(|stats| stats.n_seen != [0; 3]);
        let stats = stats.with_context(|| {
            let (name, dir) = (channel.name(), dataset.dir().display());
            format!(
                "gan.channels asks for \"{name}\", which {dir} does not show in any frame to train on: set posture = true \
                 under [dataset] and make the dataset again, or leave it out"
            )
        })?;
        Ok(ChannelNormalisation::new(channel, stats.n_seen, stats.mean, stats.std))
    };
    PostureChannel::ALL.into_iter().filter(|channel| wanted.contains(channel)).map(of).collect()
}

/// Statistics of the training split; bone lengths where the dataset does not state them are measured.
pub fn normalisation(dataset: &Dataset) -> Result<Normalisation> {
    let stated = &dataset.info().bone_lengths_metres;
    let mut lengths: Vec<f32> = (0..N_BONES).map(|bone| stated.get(bone).map_or(0.0, |v| *v as f32)).collect();
    if lengths.iter().all(|length| *length == 0.0) {
        let longest = dataset.samples(Split::Train).into_iter().max_by_key(|sample| sample.n_frames);
        let longest = longest.context("the training split of the dataset is empty")?;
        lengths = bones::measure(&dataset.read(&longest)?.motion).to_vec();
    }
    Ok(Normalisation::new(&dataset.stats().mean(), &dataset.stats().std(), lengths))
}
