//! A generator and its discriminator in training: one optimiser step, and saving to and loading from checkpoints.

use super::super::losses::{self, number};
use super::super::score::Validation;
use super::super::speakers::SpeakerSet;
use super::super::windows::WindowBatch;
use super::super::{average, rates};
use super::batch::StepBatch;
use super::loss_log::{LossLog, Losses};
use crate::generate::model::{BEST, GENERATOR, SpeakerMetadata};
use crate::train::optim::adam::{self, Adam};
use crate::train::{resume, word_vectors};
use anyhow::{Context, Result, ensure};
use candle_core::{Device, Tensor};
use orator_dataset::config::{GanConfig, GanSettings, to_stored};
use orator_formats::checkpoint;
use orator_formats::word_vectors::WordVectors;
use orator_nn::gan::discriminator::{Discriminator, motion};
use orator_nn::gan::generator::Generator;
use orator_nn::gan::words::WORDS;
use orator_nn::gpu::launch::is_on_device;
use orator_nn::params::Params;
use orator_nn::weights::Contents;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// Prefix of the generator without averaging, if the generator of the checkpoint is the average over the steps (EMA).
const LAST_STEP: &str = "training.generator.";
const DISCRIMINATOR: &str = "discriminator.";
const ADAM_G: &str = "adam.generator.";
const ADAM_D: &str = "adam.discriminator.";
/// Largest gradient norm of each network; larger gradients are clipped.
pub const MAX_NORM: f64 = 10.0;

/// Settings that a resumed training takes from the configuration; all others come from the checkpoint.
const OVERRIDABLE_ON_RESUME: [&str; 4] = ["steps", "patience", "checkpoint_every", "keep_checkpoints"];

#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct TrainerState {
    pub speaker: SpeakerMetadata,
    /// All further speakers of a training of several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub other_speakers: Vec<SpeakerMetadata>,
    pub settings: GanSettings,
    pub step: usize,
    /// Step and score of the best validation so far.
    pub best: Option<(usize, f32)>,
}

/// Networks and optimisers of a training, with its step count.
pub struct GanTrainer {
    pub speakers: SpeakerSet,
    pub settings: GanSettings,
    pub generator: Generator,
    pub(super) generator_params: Params,
    /// Exponential moving average of the generator, if `ema_decay` is above 0.
    pub(super) ema: Option<(Generator, Params)>,
    /// Tensors of both on a GPU.
    pub(super) ema_parts: Option<Tensor>,
    pub(super) discriminator: Discriminator,
    discriminator_params: Params,
    pub(super) adam_g: Adam,
    pub(super) adam_d: Adam,
    pub(super) losses: LossLog,
    pub step: usize,
    /// Step and score of the best validation so far.
    pub best: Option<(usize, f32)>,
}

impl GanTrainer {
    /// Networks on `device` for one speaker or several, with random initial weights determined by the seed.
    pub fn new(speakers: Vec<SpeakerMetadata>, settings: GanSettings, device: &Device) -> Result<Self> {
        let mut generator_params = Params::new(settings.seed).on(device);
        let speakers = SpeakerSet::new(speakers, settings.bone_loss, device)?;
        let generator = Generator::new(&mut generator_params, speakers.network())?;
        let ema = if settings.ema_decay > 0.0 {
            let mut params = Params::frozen().on(device);
            let ema = Generator::new(&mut params, speakers.network())?;
            params.load(&generator_params.tensors()?)?;
            Some((ema, params))
        } else {
            None
        };
        // Inverted seed, so that equally named tensors of the two networks are initialised differently.
        let mut discriminator_params = Params::new(!settings.seed).on(device);
        let discriminator = Discriminator::new(&mut discriminator_params, speakers.n_features())?;
        let adam = adam::Config { max_norm: Some(MAX_NORM), ..adam::Config::default() };
        let decaying = adam::Config { weight_decay: settings.weight_decay, ..adam };
        let factors = |name: &str| rates::factors(name, settings.shared_rate);
        Ok(Self {
            adam_g: Adam::with_rates(&generator_params, decaying, factors)?,
            adam_d: Adam::new(&discriminator_params, adam)?,
            ema_parts: ema.as_ref().map(|(_, ema)| average::parts(ema, &generator_params)).transpose()?.flatten(),
            losses: LossLog::default(),
            generator_params,
            generator,
            ema,
            discriminator_params,
            discriminator,
            speakers,
            settings,
            step: 0,
            best: None,
        })
    }

    pub fn n_parameters(&self) -> usize {
        self.generator_params.n_parameters()
    }

    pub fn device(&self) -> &Device {
        self.generator_params.device()
    }

    /// Runs one step of the discriminator, then one of the generator, on the same windows; returns its losses.
    pub fn step(&mut self, batch: &WindowBatch) -> Result<Losses> {
        self.step_in_phases(batch, &mut |_| ())
    }

    /// Like `step`; calls `phase` with its name at the end of each phase, for profiling (on the CPU).
    pub fn step_in_phases(&mut self, batch: &WindowBatch, phase: &mut dyn FnMut(&'static str)) -> Result<Losses> {
        let batch = StepBatch::draw(batch, &self.settings, self.speakers.network(), self.step, self.device())?;
        self.advance(&batch, phase)?;
        let (_, losses) = self.take_losses()?.pop().context("a step without losses")?;
        Ok(losses)
    }

    /// Losses of the steps since the last call, with the number of their step. On a GPU this waits for all of its work.
    pub fn take_losses(&mut self) -> Result<Vec<(usize, Losses)>> {
        self.losses.take(&self.settings)
    }

    /// Runs a step like `step`, without reading its losses on a GPU; `batch` is on the device of the training.
    pub fn advance(&mut self, batch: &StepBatch, phase: &mut dyn FnMut(&'static str)) -> Result<()> {
        if is_on_device(&batch.windows.poses) {
            return self.advance_on_device(batch);
        }
        let (noise, drawn, batch) = (&batch.noise, batch, &batch.windows);
        let n_windows = batch.poses.dim(0)?;
        // Noise of real motion (0) or generated motion (1).
        let with_noise = |motion: Tensor, which: usize| match noise {
            Some(noise) => motion + noise.narrow(0, which * n_windows, n_windows)?,
            None => Ok(motion),
        };
        let GanSettings { lambda_l1, lambda_speed, lambda_energy, lambda_velocity, lambda_bone, .. } = self.settings;
        let (lambda_gan, learning_rate) = (self.settings.adversarial_weight(self.step), self.settings.rate(self.step));
        let raw = self.predict(drawn)?;
        let generated = self.speakers.poses(&raw, &batch.speakers)?;
        // Differences are masked where either frame is, so that missing joints look the same in real and generated
        // motion.
        let mask = losses::both_visible(&batch.mask)?;
        let generated_motion = (motion(&generated)? * &mask)?;
        phase("generator forward");

        let mut discriminator_loss_value = 0.0;
        let generated_motion = if lambda_gan > 0.0 { with_noise(generated_motion, 1)? } else { generated_motion };
        if lambda_gan > 0.0 {
            let real_motion = with_noise((motion(&batch.poses)? * &mask)?, 0)?;
            let real_scores = self.discriminator.forward(&real_motion, true)?;
            let generated_scores = self.discriminator.forward(&generated_motion.detach(), true)?;
            let loss = losses::discriminator_loss(self.settings.adversarial, &real_scores, &generated_scores)?;
            discriminator_loss_value = number(&loss)?;
            self.adam_d.step(&loss.backward()?, learning_rate)?;
        }
        phase("discriminator's step");

        let l1 = losses::l1(&generated, &batch.poses, &batch.mask)?;
        let mut total = (&l1 * lambda_l1)?;
        let (mut velocity, mut bone, mut adversarial) = (0.0, 0.0, 0.0);
        let mut add = |loss: Tensor, weight: f64| -> Result<f64> {
            total = (&total + (&loss * weight)?)?;
            number(&loss)
        };
        let (mut speed, mut energy) = (None, None);
        if lambda_speed > 0.0 {
            speed = Some(add(losses::speed(&generated, &batch.poses, &batch.mask)?, lambda_speed)?);
        }
        if lambda_energy > 0.0 {
            energy = Some(add(losses::energy(&generated, &batch.poses, &batch.mask)?, lambda_energy)?);
        }
        if lambda_velocity > 0.0 {
            velocity = add(losses::velocity(&generated, &batch.poses, &batch.mask)?, lambda_velocity)?;
        }
        if lambda_bone > 0.0
            && let Some(loss) = self.speakers.bone_loss(&generated, &batch.speakers)?
        {
            bone = add(loss, lambda_bone)?;
        }
        if lambda_gan > 0.0 {
            let scores = self.discriminator.forward(&generated_motion, true)?;
            adversarial = add(losses::generator_loss(self.settings.adversarial, &scores)?, lambda_gan)?;
        }
        phase("generator's losses");
        let gradients = total.backward()?;
        phase("generator backward");
        let gradient_norm = self.adam_g.step(&gradients, learning_rate)?;
        phase("generator's Adam");
        if let Some((_, ema)) = &self.ema {
            average::update(ema, &self.generator_params, None, self.settings.ema_decay, self.step)?;
        }
        self.step += 1;
        let (l1, discriminator) = (number(&l1)?, discriminator_loss_value);
        let losses = Losses { l1, speed, energy, velocity, bone, adversarial, discriminator, gradient_norm };
        self.losses.push(self.step, losses);
        Ok(())
    }

    /// L1 error of the averaged generator (`ema_generator`) on a batch of windows.
    pub fn error(&self, batch: &WindowBatch) -> Result<f64> {
        let batch = batch.on(self.device())?;
        let (generator, n_frames) = (self.ema_generator(), self.settings.window_frames);
        let encoded = generator.frames(&batch.mels, &batch.speakers, batch.words.as_ref(), n_frames, false)?;
        let raw = generator.decode(&encoded, false)?.detach();
        number(&losses::l1(&self.speakers.poses(&raw, &batch.speakers)?, &batch.poses, &batch.mask)?)
    }

    /// Raw poses of a batch in training mode, with dropout of words and of whole channels of the encoded audio.
    pub(super) fn predict(&self, batch: &StepBatch) -> Result<Tensor> {
        let StepBatch { windows, dropout, .. } = batch;
        let n_frames = self.settings.window_frames;
        let encoded =
            self.generator.frames(&windows.mels, &windows.speakers, windows.words.as_ref(), n_frames, true)?;
        Ok(match dropout {
            Some(factors) => self.generator.decode(&encoded.broadcast_mul(factors)?, true)?,
            None => self.generator.decode(&encoded, true)?,
        })
    }

    /// Generator for validation and generation: the average over the steps if there is one, else that of the last step.
    pub fn ema_generator(&self) -> &Generator {
        self.ema.as_ref().map_or(&self.generator, |(ema, _)| ema)
    }

    fn ema_tensors(&self) -> Result<BTreeMap<String, Tensor>> {
        Ok(self.ema.as_ref().map_or(&self.generator_params, |(_, params)| params).tensors()?)
    }

    /// Writes the checkpoint of this step, and deletes old ones beyond `keep_checkpoints`.
    pub fn save(&self, folder: &Path) -> Result<()> {
        let mut contents = Contents { facts: self.stored()?, tensors: BTreeMap::new() };
        contents.add(GENERATOR, self.ema_tensors()?);
        if self.ema.is_some() {
            contents.add(LAST_STEP, self.generator_params.tensors()?);
        }
        contents.add(DISCRIMINATOR, self.discriminator_params.tensors()?);
        contents.add("", self.adam_g.tensors(ADAM_G)?);
        contents.add("", self.adam_d.tensors(ADAM_D)?);
        contents.write(&checkpoint::path(folder, self.step))?;
        checkpoint::prune(folder, self.settings.keep_checkpoints)
    }

    /// Writes the generator of this step as the best checkpoint.
    pub fn save_best(&self, folder: &Path, validation: &Validation) -> Result<()> {
        let mut facts = self.stored()?;
        facts["validation"] = serde_json::to_value(validation)?;
        let mut contents = Contents { facts, tensors: BTreeMap::new() };
        contents.add(GENERATOR, self.ema_tensors()?);
        contents.write(&folder.join(BEST))
    }

    fn stored(&self) -> Result<Value> {
        let (defaults, settings) = (GanSettings::default(), self.settings.clone());
        let mut speakers = self.speakers.all().iter().cloned();
        let speaker = speakers.next().context("no speaker to train")?;
        let other_speakers = speakers.collect();
        let state = TrainerState { speaker, other_speakers, settings, step: self.step, best: self.best };
        let mut facts = serde_json::to_value(&state)?;
        facts["settings"] = to_stored("gan", &self.settings)?;
        if let Some(stored) = facts["settings"].as_object_mut() {
            // Keys that version 0.1 did not have are written only if they differ from what it did.
            let is_default = [
                ("channels", self.settings.channels == defaults.channels),
                ("bone_loss", self.settings.bone_loss == defaults.bone_loss),
                ("words", self.settings.words == defaults.words),
            ];
            is_default.iter().filter(|(_, is_default)| *is_default).for_each(|(key, _)| {
                stored.shift_remove(*key);
            });
        }
        Ok(facts)
    }

    /// Initialises the word embeddings, from `vectors` if given.
    pub fn initialise_words(&self, vectors: Option<&WordVectors>) -> Result<()> {
        let Some(words) = &self.speakers.all()[0].words else { return Ok(()) };
        word_vectors::initialise(&self.generator_params, WORDS, &words.vocabulary, vectors)?;
        self.set_tensors(BTreeMap::new())
    }

    /// Tensors of the generator of the last step.
    pub fn generator_tensors(&self) -> Result<BTreeMap<String, Tensor>> {
        Ok(self.generator_params.tensors()?)
    }

    /// Replaces tensors of the generator, also in its average.
    pub fn set_tensors(&self, tensors: BTreeMap<String, Tensor>) -> Result<()> {
        let mut all = self.generator_tensors()?;
        all.extend(tensors);
        self.generator_params.load(&all)?;
        self.ema.iter().try_for_each(|(_, ema)| ema.load(&all))
    }

    /// Copies the weights of another model's generator, and those of its discriminator if the checkpoint has one. The
    /// tensors of the speaker layer come from `layer`; `None` leaves them as they are, like those of the words.
    pub fn initialise_from(&self, other: &Contents, layer: Option<&BTreeMap<String, Tensor>>) -> Result<()> {
        let mut generator = other.part(GENERATOR);
        generator.retain(|name, _| !rates::is_of_speaker(name));
        generator.extend(layer.into_iter().flatten().map(|(name, tensor)| (name.clone(), tensor.clone())));
        self.set_tensors(generator)?;
        let discriminator = other.part(DISCRIMINATOR);
        if !discriminator.is_empty() {
            self.discriminator_params.load(&discriminator)?;
        }
        Ok(())
    }

    /// Restores the tensors, the step and the best score of a checkpoint.
    pub fn load(&mut self, stored: &TrainerState, contents: &Contents) -> Result<()> {
        match &self.ema {
            Some((_, ema)) => {
                ema.load(&contents.part(GENERATOR))?;
                self.generator_params.load(&contents.part(LAST_STEP))?;
            }
            None => self.generator_params.load(&contents.part(GENERATOR))?,
        }
        self.discriminator_params.load(&contents.part(DISCRIMINATOR))?;
        self.adam_g.load(ADAM_G, &contents.tensors)?;
        self.adam_d.load(ADAM_D, &contents.tensors)?;
        (self.step, self.best) = (stored.step, stored.best);
        Ok(())
    }
}

impl TrainerState {
    /// Reads the metadata of a training checkpoint. Fails if it is of another kind or program version.
    pub fn from_checkpoint(contents: &Contents) -> Result<Self> {
        ensure!(
            contents.facts["settings"].is_object(),
            "this version cannot resume it; choose another --out, or move that folder away"
        );
        let state: Self = serde_json::from_value(contents.facts.clone()).context("incompatible metadata")?;
        let GanSettings { batch, steps, epoch_steps, window_frames, .. } = state.settings;
        ensure!(
            batch > 1 && steps > 0 && epoch_steps > 0 && window_frames > 0,
            "invalid settings: batch must be at least 2; steps, epoch_steps and window_frames at least 1"
        );
        Ok(state)
    }

    /// All speakers in the order of their indices.
    pub fn speakers(&self) -> Vec<SpeakerMetadata> {
        std::iter::once(&self.speaker).chain(&self.other_speakers).cloned().collect()
    }

    /// Settings of the resumed training, and a message for each difference from `requested`.
    pub fn settings(&self, requested: &GanConfig) -> Result<(GanSettings, Vec<String>)> {
        resume::settings(&self.settings, requested, "gan", &OVERRIDABLE_ON_RESUME)
    }
}
