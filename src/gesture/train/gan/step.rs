//! A generator and its discriminator in training: one optimiser step, and saving to and loading from checkpoints.

use super::losses::{self, number};
use super::score::Validation;
use super::speakers::SpeakerSet;
use super::windows::WindowBatch;
use super::{augment, average, rates, words};
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
use orator_nn::params::Params;
use orator_nn::weights::Contents;
use rand::Rng;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// Prefix of the generator without averaging, if the generator of the checkpoint is the average over the steps (EMA).
const LAST_STEP: &str = "training.generator.";
const DISCRIMINATOR: &str = "discriminator.";
const ADAM_G: &str = "adam.generator.";
const ADAM_D: &str = "adam.discriminator.";
/// Seed modifier that makes dropout independent of the other random numbers of a step.
const DROPOUT: u64 = 0x6472_6f70;
const WORD_DROPOUT: u64 = 0x776f_7264;
/// Largest gradient norm of each network; larger gradients are clipped.
pub const MAX_NORM: f64 = 10.0;

/// Settings that a resumed training takes from the configuration; all others come from the checkpoint.
const OVERRIDABLE_ON_RESUME: [&str; 4] = ["steps", "patience", "checkpoint_every", "keep_checkpoints"];

/// Unweighted losses of one step, and the gradient norm of the generator.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Losses {
    pub l1: f64,
    /// `None` if its weight is 0, and so for `energy`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<f64>,
    pub velocity: f64,
    pub bone: f64,
    pub adversarial: f64,
    pub discriminator: f64,
    pub gradient_norm: f64,
}

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
    generator_params: Params,
    /// Exponential moving average of the generator, if `ema_decay` is above 0.
    ema: Option<(Generator, Params)>,
    discriminator: Discriminator,
    discriminator_params: Params,
    adam_g: Adam,
    adam_d: Adam,
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

    /// Runs one step of the discriminator, then one of the generator, on the same windows.
    pub fn step(&mut self, batch: &WindowBatch) -> Result<Losses> {
        self.step_in_phases(batch, &mut |_| ())
    }

    /// Like `step`; calls `phase` with its name at the end of each phase, for profiling.
    pub fn step_in_phases(&mut self, batch: &WindowBatch, phase: &mut dyn FnMut(&'static str)) -> Result<Losses> {
        let batch = batch.on(self.device())?;
        let GanSettings { lambda_l1, lambda_speed, lambda_energy, lambda_velocity, lambda_bone, .. } = self.settings;
        let (lambda_gan, learning_rate) = (self.settings.adversarial_weight(self.step), self.settings.rate(self.step));
        let raw = self.predict(&batch)?;
        let generated = self.speakers.poses(&raw, &batch.speakers)?;
        // Differences are masked where either frame is, so that missing joints look the same in real and generated
        // motion.
        let mask = losses::both_visible(&batch.mask)?;
        let generated_motion = (motion(&generated)? * &mask)?;
        phase("generator forward");

        let mut discriminator_loss_value = 0.0;
        let generated_motion = if lambda_gan > 0.0 { self.with_noise(generated_motion, 0)? } else { generated_motion };
        if lambda_gan > 0.0 {
            let real_motion = self.with_noise((motion(&batch.poses)? * &mask)?, 1)?;
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
            average::update(ema, &self.generator_params, self.settings.ema_decay, self.step)?;
        }
        self.step += 1;
        let l1 = number(&l1)?;
        Ok(Losses {
            l1,
            speed,
            energy,
            velocity,
            bone,
            adversarial,
            discriminator: discriminator_loss_value,
            gradient_norm,
        })
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
    fn predict(&self, batch: &WindowBatch) -> Result<Tensor> {
        let (n_frames, dropout) = (self.settings.window_frames, self.settings.dropout);
        let rng = &mut resume::step_rng(self.settings.seed ^ WORD_DROPOUT, self.step);
        let n_indices = self.speakers.network().vocabulary;
        let words = batch.words.as_ref().map(|words| words::dropped(words, n_indices, rng)).transpose()?;
        let encoded = self.generator.frames(&batch.mels, &batch.speakers, words.as_ref(), n_frames, true)?;
        if dropout == 0.0 {
            return Ok(self.generator.decode(&encoded, true)?);
        }
        let (n_windows, _, n_channels) = encoded.dims3()?;
        let mut rng = resume::step_rng(self.settings.seed ^ DROPOUT, self.step);
        let factor = |_| if rng.random_bool(dropout) { 0.0 } else { 1.0 / (1.0 - dropout) as f32 };
        let factors: Vec<f32> = (0..n_windows * n_channels).map(factor).collect();
        let factors = Tensor::from_vec(factors, (n_windows, 1, n_channels), encoded.device())?;
        Ok(self.generator.decode(&encoded.broadcast_mul(&factors)?, true)?)
    }

    /// Input of the discriminator: motion with noise, which keeps the discriminator from memorising the windows
    /// (Arjovsky & Bottou 2017). `which` selects the random numbers.
    fn with_noise(&self, motion: Tensor, which: u64) -> Result<Tensor> {
        let std = self.settings.augment_pose_noise;
        if std == 0.0 {
            return Ok(motion);
        }
        let noise = augment::gaussian(motion.elem_count(), std, self.settings.seed ^ which, self.step);
        Ok((&motion + Tensor::from_vec(noise, motion.shape(), motion.device())?)?)
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

impl Losses {
    /// Losses by name, for the check that the training has not diverged.
    pub fn named(&self) -> [(&'static str, f64); 5] {
        [
            ("L1", self.l1),
            ("velocity", self.velocity),
            ("bone", self.bone),
            ("adversarial", self.adversarial),
            ("discriminator", self.discriminator),
        ]
    }
}
