//! Training a speaker's generator against the motion discriminator: one straight loop. The same dataset, settings and
//! seed give the same checkpoints, also when the training was interrupted: the windows of a step depend on the seed
//! and the step alone, everything else is in the checkpoint.

use super::adam::{self, Adam};
use super::checkpoint::{self, Contents};
use super::examples::{Batch, Examples};
use super::log::Log;
use super::losses::{self, BoneConstancy};
use super::metrics::Validation;
use super::poses::{N_NUMBERS, Normalisation};
use super::speaker::{Facts, GENERATOR};
use super::validate::HeldOut;
use crate::config::Gan;
use crate::dataset::{CHECKSUMS, Dataset, Split};
use crate::motion::bones;
use crate::nn::discriminator::{Discriminator, motion};
use crate::nn::params::Params;
use crate::nn::unet::{Config, FRAMES_MULTIPLE, Generator};
use crate::stage::progress::Progress;
use crate::types::skeleton::N_BONES;
use anyhow::{Context, Result, bail, ensure};
use candle_core::{DType, Tensor};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const DISCRIMINATOR: &str = "discriminator.";
const ADAM_G: &str = "adam.generator.";
const ADAM_D: &str = "adam.discriminator.";
/// Steps between two lines of the log.
const LOG_EVERY: usize = 10;
/// Gradients are clipped to this norm; a loss beyond the limit is a training that has exploded.
const MAX_NORM: f64 = 10.0;
const LOSS_LIMIT: f64 = 1e4;
/// The best checkpoint by validation L1.
pub const BEST: &str = "best.safetensors";

/// How a training ended.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Steps of this training altogether, and the step this run began at.
    pub steps: usize,
    pub began_at: usize,
    pub n_windows: usize,
    pub n_parameters: usize,
    /// Of the newest checkpoint.
    pub validation: Validation,
    pub newest: PathBuf,
    /// Best by validation L1.
    pub best: PathBuf,
    pub best_step: usize,
}

/// Losses of one step, in the order of the log.
struct Losses {
    l1: f64,
    bone: f64,
    adversarial: f64,
    discriminator: f64,
}

/// Trains on `dataset` until `settings.steps`, going on from the newest checkpoint in `folder`.
///
/// # Errors
/// No window to train on; a checkpoint of other settings or data; a loss that is not finite or explodes (the last good
/// checkpoint stays).
pub fn train(dataset: &Dataset, settings: &Gan, folder: &Path, progress: &dyn Progress) -> Result<Outcome> {
    check(settings)?;
    let normal = normalisation(dataset)?;
    let examples = Examples::load(dataset, Split::Train, &normal, settings.window_frames, settings.stride_frames)?;
    ensure!(
        !examples.is_empty(),
        "{}: no interval of the training split is as long as a window of {} frames; more footage, or a smaller \
         gan.window_frames",
        dataset.dir().display(),
        settings.window_frames
    );
    let held_out = HeldOut::load(dataset, settings, &normal, progress)?;
    let mut training = Training::new(dataset, settings, normal)?;
    if let Some((_, newest)) = checkpoint::list(folder)?.pop() {
        training.resume(&newest)?;
        progress.say(&format!("going on from {} (step {})", newest.display(), training.step));
    }
    let began_at = training.step;
    let mut log = Log::open(&folder.join("metrics.jsonl"), began_at)?;
    let task = progress.begin(&format!("train {}", dataset.info().speaker), settings.steps as u64);
    task.advance(began_at.min(settings.steps) as u64);

    let mut last_validation = None;
    while training.step < settings.steps {
        let batch = examples.batch(&draw(settings.seed, training.step, settings.batch, examples.len()))?;
        let losses = training.step(&batch)?;
        training.stop_if_broken(&losses, folder)?;
        task.advance(1);
        if training.step % LOG_EVERY == 0 {
            task.detail(&format!("L1 {:.3} adv {:.3} D {:.3}", losses.l1, losses.adversarial, losses.discriminator));
            log.write(&losses.line(training.step))?;
        }
        if training.step % settings.checkpoint_every == 0 || training.step == settings.steps {
            let validation = held_out.validate(&training.generator, &training.facts.normalisation)?;
            log.write(&json!({ "step": training.step, "validation": validation }))?;
            training.save(folder, &validation)?;
            last_validation = Some(validation);
        }
    }
    let Some((_, newest)) = checkpoint::list(folder)?.pop() else {
        bail!("gan.steps is 0: nothing to train");
    };
    let validation = match last_validation {
        Some(validation) => validation,
        None => held_out.validate(&training.generator, &training.facts.normalisation)?,
    };
    Ok(Outcome {
        steps: training.step,
        began_at,
        n_windows: examples.len(),
        n_parameters: training.generator_params.n_parameters(),
        validation,
        newest,
        best: folder.join(BEST),
        best_step: training.best.map_or(training.step, |(step, _)| step),
    })
}

fn check(settings: &Gan) -> Result<()> {
    ensure!(
        settings.window_frames > 0 && settings.window_frames.is_multiple_of(FRAMES_MULTIPLE),
        "gan.window_frames is {}: it must be a multiple of {FRAMES_MULTIPLE}",
        settings.window_frames
    );
    ensure!(settings.batch > 1, "gan.batch is {}: batch norm needs at least 2 windows", settings.batch);
    ensure!(
        settings.checkpoint_every > 0 && settings.stride_frames > 0,
        "gan.checkpoint_every and gan.stride_frames must be at least 1"
    );
    Ok(())
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

/// The windows of a step, drawn with replacement.
fn draw(seed: u64, step: usize, n: usize, n_windows: usize) -> Vec<usize> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(step as u64 + 1);
    (0..n).map(|_| rng.random_range(0..n_windows as u64) as usize).collect()
}

/// Networks, optimisers and where they are.
struct Training<'a> {
    settings: &'a Gan,
    facts: Facts,
    /// What a checkpoint must agree with to be gone on from.
    origin: Value,
    generator_params: Params,
    generator: Generator,
    discriminator_params: Params,
    discriminator: Discriminator,
    adam_g: Adam,
    adam_d: Adam,
    bones: BoneConstancy,
    /// Steps done.
    step: usize,
    /// Step and validation L1 of the best checkpoint.
    best: Option<(usize, f32)>,
}

impl<'a> Training<'a> {
    fn new(dataset: &Dataset, settings: &'a Gan, normal: Normalisation) -> Result<Self> {
        let config = Config::of(settings.preset.parse()?, N_NUMBERS);
        let mut generator_params = Params::new(settings.seed);
        let generator = Generator::new(&mut generator_params, &config)?;
        // Another seed, or tensors of the same name would begin alike.
        let mut discriminator_params = Params::new(!settings.seed);
        let discriminator = Discriminator::new(&mut discriminator_params, N_NUMBERS)?;
        let adam = adam::Config { max_norm: Some(MAX_NORM), ..adam::Config::default() };
        let index = dataset.dir().join(CHECKSUMS);
        let index = std::fs::read(&index).with_context(|| format!("reading {}", index.display()))?;
        let mut origin = serde_json::to_value(settings)?;
        for later in ["steps", "checkpoint_every", "keep_checkpoints"] {
            origin.as_object_mut().and_then(|origin| origin.shift_remove(later));
        }
        Ok(Self {
            settings,
            origin: json!({ "settings": origin, "dataset": blake3::hash(&index).to_hex().as_str() }),
            bones: BoneConstancy::new(&normal, DType::F32)?,
            facts: Facts::new(&dataset.info().speaker, dataset.info().fps, config, normal),
            adam_g: Adam::new(&generator_params, adam),
            adam_d: Adam::new(&discriminator_params, adam),
            generator_params,
            generator,
            discriminator_params,
            discriminator,
            step: 0,
            best: None,
        })
    }

    /// One step of the discriminator, then one of the generator, on the same windows.
    fn step(&mut self, batch: &Batch) -> Result<Losses> {
        let Gan { lambda_l1, lambda_gan, lambda_bone, learning_rate, .. } = *self.settings;
        let made = self.generator.forward(&batch.mels, self.settings.window_frames, true)?;
        // Differences count where both frames do, so that a missing joint looks the same in both.
        let n = self.settings.window_frames - 1;
        let mask = (batch.mask.narrow(2, 1, n)? * batch.mask.narrow(2, 0, n)?)?;
        let made_motion = (motion(&made)? * &mask)?;

        let mut of_discriminator = 0.0;
        if lambda_gan > 0.0 {
            let real = self.discriminator.forward(&(motion(&batch.poses)? * &mask)?, true)?;
            let fake = self.discriminator.forward(&made_motion.detach(), true)?;
            let loss = losses::discriminator(&real, &fake)?;
            of_discriminator = number(&loss)?;
            self.adam_d.step(&loss.backward()?, learning_rate)?;
        }

        let l1 = losses::l1(&made, &batch.poses, &batch.mask)?;
        let bone = self.bones.loss(&made)?;
        let mut total = ((&l1 * lambda_l1)? + (&bone * lambda_bone)?)?;
        let mut adversarial = 0.0;
        if lambda_gan > 0.0 {
            let loss = losses::generator(&self.discriminator.forward(&made_motion, true)?)?;
            adversarial = number(&loss)?;
            total = (total + (loss * lambda_gan)?)?;
        }
        let norm = self.adam_g.step(&total.backward()?, learning_rate)?;
        self.step += 1;
        // A norm that is not finite has left the weights alone, but the training cannot go on.
        let l1 = if norm.is_finite() { number(&l1)? } else { norm };
        Ok(Losses { l1, bone: number(&bone)?, adversarial, discriminator: of_discriminator })
    }

    fn stop_if_broken(&self, losses: &Losses, folder: &Path) -> Result<()> {
        let all = [losses.l1, losses.bone, losses.adversarial, losses.discriminator];
        if all.iter().all(|loss| loss.is_finite() && loss.abs() < LOSS_LIMIT) {
            return Ok(());
        }
        let kept = match checkpoint::list(folder)?.pop() {
            Some((step, path)) => format!("the checkpoint of step {step} is kept: {}", path.display()),
            None => "there is no checkpoint yet".to_owned(),
        };
        bail!(
            "the training broke at step {}: L1 {}, bone {}, adversarial {}, discriminator {}; {kept}. Try a smaller \
             gan.learning_rate",
            self.step,
            losses.l1,
            losses.bone,
            losses.adversarial,
            losses.discriminator
        )
    }

    /// Writes the checkpoint of this step, and the best one when it is; old ones go.
    fn save(&mut self, folder: &Path, validation: &Validation) -> Result<()> {
        // In f32, whose decimals come back exactly from JSON.
        let l1 = validation.generator.l1 as f32;
        let is_best = self.best.is_none_or(|(_, best)| l1 < best);
        if is_best {
            self.best = Some((self.step, l1));
        }
        let facts = json!({
            "speaker": self.facts,
            "step": self.step,
            "origin": self.origin,
            "validation": validation,
            "best": self.best,
        });
        let mut contents = Contents { facts, tensors: BTreeMap::new() };
        contents.add(GENERATOR, self.generator_params.tensors()?);
        contents.add(DISCRIMINATOR, self.discriminator_params.tensors()?);
        contents.add("", self.adam_g.tensors(ADAM_G)?);
        contents.add("", self.adam_d.tensors(ADAM_D)?);
        if is_best {
            // To generate with: the generator alone.
            let tensors = contents.tensors.iter().filter(|(name, _)| name.starts_with(GENERATOR));
            let tensors = tensors.map(|(name, tensor)| (name.clone(), tensor.clone())).collect();
            Contents { facts: contents.facts.clone(), tensors }.write(&folder.join(BEST))?;
        }
        contents.write(&checkpoint::path(folder, self.step))?;
        checkpoint::prune(folder, self.settings.keep_checkpoints)
    }

    fn resume(&mut self, path: &Path) -> Result<()> {
        let contents = Contents::read(path)?;
        let mut load = || -> Result<()> {
            checkpoint::expect_same(&contents.facts["origin"], "settings", &self.origin["settings"])?;
            checkpoint::expect_same(&contents.facts["origin"], "dataset", &self.origin["dataset"])?;
            self.generator_params.load(&contents.part(GENERATOR))?;
            self.discriminator_params.load(&contents.part(DISCRIMINATOR))?;
            self.adam_g.load(ADAM_G, &contents.tensors)?;
            self.adam_d.load(ADAM_D, &contents.tensors)?;
            self.best = serde_json::from_value(contents.facts["best"].clone())?;
            self.step = contents.facts["step"].as_u64().context("it has no step")? as usize;
            Ok(())
        };
        load().with_context(|| format!("cannot go on from {}", path.display()))
    }
}

impl Losses {
    fn line(&self, step: usize) -> Value {
        json!({
            "step": step,
            "l1": self.l1,
            "bone": self.bone,
            "adversarial": self.adversarial,
            "discriminator": self.discriminator,
        })
    }
}

fn number(scalar: &Tensor) -> Result<f64> {
    Ok(f64::from(scalar.to_scalar::<f32>()?))
}
