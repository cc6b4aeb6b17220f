//! A sequence-to-sequence network in training: one optimiser step, and saving to and loading from checkpoints.

use super::losses;
use super::segments::SegmentBatch;
use super::validate::SequenceValidation;
use crate::generate::model::BEST;
use crate::generate::seq2seq::architecture::{self, Architecture, PADDING, UNKNOWN};
use crate::generate::seq2seq::metadata::{NETWORK, SequenceMetadata};
use crate::train::gan::losses::number;
use crate::train::optim::adam::{self, Adam};
use crate::train::resume;
use anyhow::{Context, Result, ensure};
use candle_core::{Device, Tensor};
use orator_dataset::config::{Seq2seqConfig, Seq2seqSettings, to_stored};
use orator_formats::checkpoint;
use orator_nn::Mode;
use orator_nn::params::Params;
use orator_nn::seq2seq::adversarial::SegmentDiscriminator;
use orator_nn::seq2seq::config::Segment;
use orator_nn::seq2seq::predict::{GesturePredictor, TruePoses};
use orator_nn::weights::Contents;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

const DISCRIMINATOR: &str = "discriminator.";
const ADAM: &str = "adam.network.";
const ADAM_D: &str = "adam.discriminator.";
/// Settings that a resumed training takes from the configuration; all others come from the checkpoint.
const OVERRIDABLE_ON_RESUME: [&str; 5] = ["epochs", "steps", "patience", "checkpoint_every", "keep_checkpoints"];

/// Losses of one step: the weighted sum, some of its terms unweighted, and the gradient norm of the network.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SequenceLosses {
    pub total: f64,
    /// `None` for the audio baseline, which predicts codes instead of poses.
    pub l1: Option<f64>,
    pub discriminator: f64,
    pub gradient_norm: f64,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SequenceState {
    pub speaker: SequenceMetadata,
    pub settings: Seq2seqSettings,
    pub step: usize,
    /// Step and score of the best validation so far.
    pub best: Option<(usize, f32)>,
}

/// Discriminator of the adversarial network, with its optimiser.
struct Adversary {
    network: SegmentDiscriminator,
    params: Params,
    adam: Adam,
}

/// Networks and optimisers of a training, with its step count.
pub struct SequenceTrainer {
    pub metadata: SequenceMetadata,
    pub settings: Seq2seqSettings,
    pub network: Box<dyn GesturePredictor>,
    params: Params,
    adam: Adam,
    adversary: Option<Adversary>,
    /// Settings of the loss, which differ from `settings` for the adversarial network.
    loss: Seq2seqSettings,
    pub step: usize,
    /// Step and score of the best validation so far.
    pub best: Option<(usize, f32)>,
}

impl SequenceTrainer {
    /// Networks on `device` with random initial weights, determined by the seed.
    pub fn new(metadata: SequenceMetadata, settings: Seq2seqSettings, device: &Device) -> Result<Self> {
        let mut params = Params::new(settings.seed).on(device);
        let network = architecture::network(metadata.architecture, &mut params, &metadata.network)?;
        let is_adversarial = metadata.architecture == Architecture::Adversarial;
        let beta1 = if is_adversarial { 0.5 } else { 0.9 };
        let adam_config =
            adam::Config { beta1, beta2: if is_adversarial { 0.9 } else { 0.999 }, ..adam::Config::default() };
        let adversary = |seed: u64| -> Result<Adversary> {
            let mut params = Params::new(seed).on(device);
            let network = SegmentDiscriminator::new(&mut params, &metadata.network)?;
            Ok(Adversary { network, adam: Adam::new(&params, adam_config)?, params })
        };
        let loss = if is_adversarial { losses::adversarial_settings(&settings) } else { settings.clone() };
        Ok(Self {
            adam: Adam::new(&params, adam_config)?,
            // Inverted seed, so that equally named tensors of the two networks are initialised differently.
            adversary: is_adversarial.then(|| adversary(!settings.seed)).transpose()?,
            params,
            network,
            loss,
            metadata,
            settings,
            step: 0,
            best: None,
        })
    }

    pub fn params(&self) -> &Params {
        &self.params
    }

    /// Runs one training step; the discriminator, if there is one, is updated before the network.
    pub fn step(&mut self, batch: &SegmentBatch) -> Result<SequenceLosses> {
        let rate = self.settings.rate(self.step);
        // The segments of the step are drawn with the seed itself.
        let mut rng = resume::step_rng(!self.settings.seed, self.step);
        if let Some(baseline) = self.network.audio_baseline() {
            let total = if self.step < self.settings.autoencoder_steps {
                baseline.pose_loss(&batch.real, &normal_like(&batch.real, &mut rng)?)?
            } else {
                baseline.speech_loss(&batch.segment.audio, &batch.real, &mut Mode::Train(&mut rng))?
            };
            let gradient_norm = self.adam.step(&total.backward()?, rate)?;
            self.step += 1;
            let total = number(&total)?;
            return Ok(SequenceLosses { total, l1: None, discriminator: 0.0, gradient_norm });
        }
        let words = batch.segment.words.as_ref();
        let words = words.map(|words| drop_words(words, self.settings.word_dropout, &mut rng)).transpose()?;
        let segment = Segment { words, ..batch.segment.clone() };
        let predicted = batch.completed(&self.predict(&segment, &batch.real, &mut rng)?)?;
        let (mut discriminator, mut logits) = (0.0, None);
        if let Some(Adversary { network, adam, .. }) = &mut self.adversary {
            let predicted_logits = network.forward(&predicted.detach(), true)?;
            let loss = losses::discriminator(&predicted_logits, &network.forward(&batch.real, true)?)?;
            discriminator = number(&loss)?;
            adam.step(&loss.backward()?, rate)?;
            logits = Some(network.forward(&predicted, true)?);
        }
        let total = losses::total(&self.loss, &predicted, &batch.real, logits.as_ref())?;
        let gradient_norm = self.adam.step(&total.backward()?, rate)?;
        self.step += 1;
        let l1 = Some(number(&losses::l1(&predicted, &batch.real)?)?);
        Ok(SequenceLosses { total: number(&total)?, l1, discriminator, gradient_norm })
    }

    /// Predicts the poses of a segment in training. Each decoder step reads the network's own previous pose with
    /// probability `scheduled_sampling`, else the true one (FineMotion 2020, eq. 2).
    fn predict(&self, segment: &Segment, real: &Tensor, rng: &mut ChaCha8Rng) -> Result<Tensor> {
        let own = self.settings.scheduled_sampling;
        if own >= 1.0 {
            return Ok(self.network.forward(segment, &mut Mode::Train(rng))?);
        }
        let n_steps = real.dim(0)? * real.dim(1)?;
        let taken: Vec<bool> = (0..n_steps).map(|_| rng.random_bool(1.0 - own)).collect();
        let truth = TruePoses { poses: real, taken: &taken };
        Ok(self.network.forward_with_truth(segment, &truth, &mut Mode::Train(rng))?)
    }

    /// Writes the checkpoint of this step, and deletes old ones beyond `keep_checkpoints`.
    pub fn save(&self, folder: &Path) -> Result<()> {
        let mut contents = Contents { facts: self.stored()?, tensors: BTreeMap::new() };
        contents.add(NETWORK, self.params.tensors()?);
        contents.add("", self.adam.tensors(ADAM)?);
        if let Some(Adversary { params, adam, .. }) = &self.adversary {
            contents.add(DISCRIMINATOR, params.tensors()?);
            contents.add("", adam.tensors(ADAM_D)?);
        }
        contents.write(&checkpoint::path(folder, self.step))?;
        checkpoint::prune(folder, self.settings.keep_checkpoints)
    }

    /// Writes the network of this step as the best checkpoint.
    pub fn save_best(&self, folder: &Path, validation: &SequenceValidation) -> Result<()> {
        let mut facts = self.stored()?;
        facts["validation"] = serde_json::to_value(validation)?;
        let mut contents = Contents { facts, tensors: BTreeMap::new() };
        contents.add(NETWORK, self.params.tensors()?);
        contents.write(&folder.join(BEST))
    }

    fn stored(&self) -> Result<Value> {
        let (speaker, settings) = (self.metadata.clone(), self.settings.clone());
        let mut facts = serde_json::to_value(SequenceState { speaker, settings, step: self.step, best: self.best })?;
        facts["settings"] = to_stored("seq2seq", &self.settings)?;
        Ok(facts)
    }

    /// Restores the tensors, the step and the best score of a checkpoint.
    pub fn load(&mut self, stored: &SequenceState, contents: &Contents) -> Result<()> {
        self.params.load(&contents.part(NETWORK))?;
        self.adam.load(ADAM, &contents.tensors)?;
        if let Some(Adversary { params, adam, .. }) = &mut self.adversary {
            params.load(&contents.part(DISCRIMINATOR))?;
            adam.load(ADAM_D, &contents.tensors)?;
        }
        (self.step, self.best) = (stored.step, stored.best);
        Ok(())
    }
}

impl SequenceState {
    /// Reads the metadata of a training checkpoint. Fails if it is of another kind or program version.
    pub fn from_checkpoint(contents: &Contents) -> Result<Self> {
        let kind = SequenceMetadata::kind();
        ensure!(
            contents.facts["settings"].is_object() && contents.facts["speaker"]["kind"] == kind,
            "it is not a checkpoint of `orator train seq2seq` that this version can resume; choose another --out, or move \
             that folder away"
        );
        serde_json::from_value(contents.facts.clone()).context("incompatible metadata")
    }

    /// Settings of the resumed training, and a message for each difference from `requested`.
    pub fn settings(&self, requested: &Seq2seqConfig) -> Result<(Seq2seqSettings, Vec<String>)> {
        resume::settings(&self.settings, requested, "seq2seq", &OVERRIDABLE_ON_RESUME)
    }
}

impl SequenceLosses {
    /// Losses by name, for the check that the training has not diverged.
    pub fn named(&self) -> [(&'static str, f64); 3] {
        [("loss", self.total), ("L1", self.l1.unwrap_or(0.0)), ("discriminator", self.discriminator)]
    }
}

/// Word dropout: in each segment of `words` [B, ...], replaces each distinct word by `UNKNOWN` with probability
/// `share`, at all its occurrences in the segment.
pub fn drop_words(words: &Tensor, share: f64, rng: &mut ChaCha8Rng) -> Result<Tensor> {
    if share == 0.0 {
        return Ok(words.clone());
    }
    let mut indices = words.flatten_all()?.to_vec1::<u32>()?;
    let n_words = indices.len() / words.dim(0)?.max(1);
    for segment in indices.chunks_mut(n_words.max(1)) {
        let mut is_dropped = BTreeMap::new();
        for index in segment.iter_mut().filter(|index| **index != PADDING) {
            if *is_dropped.entry(*index).or_insert_with(|| rng.random_bool(share)) {
                *index = UNKNOWN;
            }
        }
    }
    Ok(Tensor::from_vec(indices, words.shape(), words.device())?)
}

/// Standard normal random numbers in the shape of a tensor.
fn normal_like(tensor: &Tensor, rng: &mut ChaCha8Rng) -> Result<Tensor> {
    let numbers: Vec<f32> = (0..tensor.elem_count()).map(|_| StandardNormal.sample(rng)).collect();
    Ok(Tensor::from_vec(numbers, tensor.shape(), tensor.device())?)
}
