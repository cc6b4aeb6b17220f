//! Initialisation of a training from another speaker's model: the weights are copied, the normalisation and the
//! skeleton are those of the new speaker.

use super::recipe::InitialWeights;
use super::step::GanTrainer;
use super::windows::JoinedWindows;
use crate::generate::model::{self, GENERATOR, SpeakerMetadata, TrainedVideo, checkpoint_file};
use crate::generate::seq2seq::architecture::{PADDING, UNKNOWN};
use anyhow::{Context, Result, bail, ensure};
use candle_core::{Device, Tensor};
use orator_dataset::Dataset;
use orator_dataset::config::GanSettings;
use orator_formats::word_vectors::WordVectors;
use orator_nn::gan::generator::Config;
use orator_nn::gan::speaker_layer::SPEAKER;
use orator_nn::gan::words::WORDS;
use orator_nn::seq2seq::encoders::table_name;
use orator_nn::weights::Contents;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Largest number of windows used to choose the initial layer of a new speaker.
const MAX_SELECTION_WINDOWS: usize = 128;

pub struct PretrainedModel {
    path: PathBuf,
    speakers: Vec<SpeakerMetadata>,
    contents: Contents,
}

impl PretrainedModel {
    /// Reads a checkpoint of `orator train gan`: a file, or the best, else the newest checkpoint of a folder. Errors
    /// name the file.
    pub fn read(path: &Path) -> Result<Self> {
        let path = checkpoint_file(path)?;
        let contents = Contents::read(&path)?;
        let speakers = model::speakers(&contents.facts);
        let speakers =
            speakers.with_context(|| format!("{} is not a checkpoint of `orator train gan`", path.display()))?;
        Ok(Self { path, speakers, contents })
    }

    /// Description of the file and its speakers for messages.
    pub fn description(&self) -> String {
        let names: Vec<&str> = self.speakers.iter().map(|speaker| speaker.name.as_str()).collect();
        format!("{} (trained on {})", self.path.display(), names.join(", "))
    }

    /// Kind of initial weights that this model provides for a training of `n_speakers` speakers.
    pub fn kind(&self, n_speakers: usize) -> InitialWeights {
        if n_speakers == 1 && self.speakers.iter().any(|speaker| speaker.network.speaker_weights) {
            InitialWeights::SeveralSpeakers
        } else {
            InitialWeights::AnotherSpeaker
        }
    }

    /// Trainer of these speakers on `device`, initialised with the weights of this model, whose videos are added to the
    /// speakers' lists. A single speaker initialised from a model of several gets the speaker layer with the smallest
    /// initial error on `windows`, among those of all speakers and their mean. Words that the model does not have get
    /// their vectors from `vectors`, or random ones.
    ///
    /// # Errors
    /// A network of another shape, or with word input if the training has none.
    pub fn trainer(
        &self,
        mut speakers: Vec<SpeakerMetadata>,
        settings: GanSettings,
        vectors: Option<&WordVectors>,
        windows: &JoinedWindows,
        device: &Device,
    ) -> Result<GanTrainer> {
        let (Some(own), Some(other)) = (speakers.first(), self.speakers.first()) else { bail!("no speaker to train") };
        let (own, other) = (&own.network, &other.network);
        ensure!(
            own.preset == other.preset && own.width == other.width && own.n_out == other.n_out,
            "{} has preset {:?}, width {} and {} outputs per pose, this training preset {:?}, width {} and {} outputs: set \
             gan.preset and gan.channels to the values of that model",
            self.path.display(),
            other.preset,
            other.width,
            other.n_out,
            own.preset,
            own.width,
            own.n_out
        );
        let secs = |of: &Config| of.look_ahead.map_or(0.0, |of| of.secs);
        ensure!(
            secs(own) == secs(other),
            "{} has a look-ahead of {} s (0: the whole speech), this training of {} s: set gan.look_ahead_secs = {}",
            self.path.display(),
            secs(other),
            secs(own),
            secs(other)
        );
        ensure!(
            other.vocabulary == 0 || own.vocabulary > 0,
            "{} reads words: set gan.words = true",
            self.path.display()
        );
        let inherited = self.speakers.iter().flat_map(|speaker| speaker.videos.iter().cloned());
        let inherited: Vec<TrainedVideo> = inherited.collect();
        speakers.iter_mut().for_each(|speaker| speaker.add_videos(inherited.clone()));
        let mut layers = self.contents.part(GENERATOR);
        layers.retain(|name, _| name.starts_with(SPEAKER));
        let is_layer_chosen = speakers.len() == 1 && !layers.is_empty();
        if is_layer_chosen {
            let speaker_weights = self.speakers[0].network.speaker_weights;
            speakers[0].network = Config { n_speakers: 1, speaker_weights, ..speakers[0].network.clone() };
        }
        let trainer = GanTrainer::new(speakers, settings, device)?;
        trainer.initialise_words(vectors)?;
        trainer.set_tensors(self.words(&trainer)?)?;
        let initialise = || {
            if is_layer_chosen {
                self.initialise_from_nearest(&trainer, &layers, windows)
            } else {
                trainer.initialise_from(&self.contents, None)
            }
        };
        initialise().with_context(|| format!("cannot initialise from {}", self.path.display()))?;
        Ok(trainer)
    }

    /// Tensors of the words with the vectors of those that the model has in common with the training; none if the
    /// model does not read words, or vectors of another dimension.
    fn words(&self, trainer: &GanTrainer) -> Result<BTreeMap<String, Tensor>> {
        let (own, other) = (&trainer.speakers.all()[0], &self.speakers[0]);
        let (Some(own_words), Some(other_words)) = (&own.words, &other.words) else { return Ok(BTreeMap::new()) };
        if own.network.word != other.network.word {
            return Ok(BTreeMap::new());
        }
        let mut tensors = self.contents.part(GENERATOR);
        tensors.retain(|name, _| name.starts_with(&format!("{WORDS}.")));
        let rows = |of: &BTreeMap<String, Tensor>| -> Result<Vec<Vec<f32>>> {
            Ok(of.get(&table_name(WORDS)).context("the network has no word embedding")?.to_vec2()?)
        };
        let (mut vectors, known) = (rows(&trainer.generator_tensors()?)?, rows(&tensors)?);
        let words = own_words.vocabulary.words().iter();
        let of_words = words.map(|word| (own_words.vocabulary.number(word), other_words.vocabulary.number(word)));
        let common = of_words.filter(|(_, number)| *number != UNKNOWN).chain([(PADDING, PADDING), (UNKNOWN, UNKNOWN)]);
        for (own, number) in common {
            if let Some(vector) = known.get(number as usize) {
                vectors[own as usize].clone_from(vector);
            }
        }
        let shape = (own.network.vocabulary, own.network.word);
        tensors.insert(table_name(WORDS), Tensor::from_vec(vectors.concat(), shape, &Device::Cpu)?);
        Ok(tensors)
    }

    /// Copies the weights, with the layer of smallest error among those of all speakers (rows of the tensors in
    /// `layers`) and their mean.
    fn initialise_from_nearest(
        &self,
        trainer: &GanTrainer,
        layers: &BTreeMap<String, Tensor>,
        windows: &JoinedWindows,
    ) -> Result<()> {
        let layer = |of: &dyn Fn(&Tensor) -> candle_core::Result<Tensor>| -> Result<BTreeMap<String, Tensor>> {
            layers.iter().map(|(name, table)| Ok((name.clone(), of(table)?))).collect()
        };
        let rows = (0..self.speakers.len()).map(|row| layer(&|table| table.narrow(0, row, 1)));
        let candidates = rows.chain(std::iter::once_with(|| layer(&|table| table.mean_keepdim(0))));
        let n = windows.len();
        let which: Vec<usize> =
            (0..n.min(MAX_SELECTION_WINDOWS)).map(|i| i * n / n.min(MAX_SELECTION_WINDOWS)).collect();
        let batch = windows.batch_changed(&which, &[])?;
        let mut best = None;
        for candidate in candidates {
            let candidate = candidate?;
            trainer.initialise_from(&self.contents, Some(&candidate))?;
            let error = trainer.error(&batch)?;
            if best.as_ref().is_none_or(|(best, _)| error < *best) {
                best = Some((error, candidate));
            }
        }
        trainer.initialise_from(&self.contents, best.as_ref().map(|(_, layer)| layer))
    }
}

/// Videos of a dataset, sorted and without duplicates, as listed in checkpoints.
pub fn videos(dataset: &Dataset) -> Vec<TrainedVideo> {
    let info = dataset.info();
    let video = |content: &String| TrainedVideo { speaker: info.speaker.clone(), content: content.clone() };
    let mut videos: Vec<TrainedVideo> = info.videos.iter().map(|of| video(&of.content)).collect();
    videos.sort();
    videos.dedup();
    videos
}
