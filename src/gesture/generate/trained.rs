//! A trained model of either kind, which generates motion of the 49 joints from sound and, for some networks, words.
//! Variants of the motion for one speech: random channels of the encoded audio are dropped for the complete sound, as
//! in training with `dropout` (Srivastava et al. 2014). Each variant is one sub-network of the dropout ensemble, so no
//! cross-fades are needed for any length of sound.

use super::GestureGenerator;
use super::model::{GenerationChoice, checkpoint_file};
use super::normalisation::Normalisation;
use super::seq2seq::SequenceGenerator;
use super::seq2seq::architecture::Architecture;
use super::seq2seq::metadata::is_sequence_kind;
use super::word_input::KnownWords;
use anyhow::{Result, bail, ensure};
use candle_core::{DType, Device, Tensor};
use orator_base::types::pose3d::Motion;
use orator_base::types::sound::{SAMPLE_RATE, Sound};
use orator_base::types::time::FrameRate;
use orator_formats::checkpoint;
use orator_formats::transcript::Word;
use orator_formats::word_vectors::WordVectors;
use orator_nn::weights::Contents;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use std::sync::Arc;

/// Checkpoint of `orator train gan` or of `orator train seq2seq`.
pub enum TrainedSpeaker {
    Gan(Box<GestureGenerator>),
    Sequence(Box<SequenceGenerator>),
}

impl TrainedSpeaker {
    /// Opens a checkpoint of one speaker: a file, or the best, else the newest one of a folder. Errors name the file.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_as(path, &GenerationChoice::default(), &Device::Cpu)
    }

    /// Like `open`, for the chosen speaker and variant, on `device`. Also fails if the network lacks the speaker or has
    /// no variants.
    pub fn open_as(path: &Path, choice: &GenerationChoice, device: &Device) -> Result<Self> {
        let file = checkpoint_file(path)?;
        let kind = &checkpoint::facts(&file)?["speaker"]["kind"];
        ensure!(
            kind.is_string(),
            "{} is not a checkpoint of `orator train gan` or `orator train seq2seq`",
            file.display()
        );
        if !is_sequence_kind(kind) {
            return Ok(Self::Gan(Box::new(GestureGenerator::open_as(&file, choice, device)?)));
        }
        let speaker = SequenceGenerator::open_on(&file, device)?;
        ensure!(
            choice.seed.is_none(),
            "{} is a checkpoint of `orator train seq2seq`, which has no variants: omit --seed and --variants",
            path.display()
        );
        if let Some(name) = choice.speaker.as_ref().filter(|name| **name != speaker.metadata.name) {
            bail!("{} is a model of {}, not of {name:?}: omit --speaker", path.display(), speaker.metadata.name);
        }
        Ok(Self::Sequence(Box::new(speaker)))
    }

    /// Like `open`, on `device`; selects the speaker of this name if the network has several.
    pub fn open_for(path: &Path, speaker: &str, device: &Device) -> Result<Self> {
        let file = checkpoint_file(path)?;
        let is_of_several = checkpoint::facts(&file)?["other_speakers"].is_array();
        let speaker = is_of_several.then(|| speaker.to_owned());
        Self::open_as(&file, &GenerationChoice { speaker, seed: None }, device)
    }

    pub fn name(&self) -> &str {
        match self {
            Self::Gan(speaker) => speaker.name(),
            Self::Sequence(speaker) => &speaker.metadata.name,
        }
    }

    /// Whether the model animates a captured skeleton, which can only be written as BVH.
    pub fn is_captured(&self) -> bool {
        matches!(self, Self::Sequence(speaker) if speaker.is_captured())
    }

    pub fn fps(&self) -> FrameRate {
        match self {
            Self::Gan(speaker) => speaker.fps(),
            Self::Sequence(speaker) => speaker.fps(),
        }
    }

    /// Sample rate of the input audio, Hz.
    pub fn rate(&self) -> u32 {
        match self {
            Self::Gan(_) => SAMPLE_RATE,
            Self::Sequence(speaker) => speaker.metadata.rate,
        }
    }

    /// Size of the vocabulary; 0 if the model does not read words.
    pub fn n_words(&self) -> usize {
        match self {
            Self::Gan(speaker) => speaker.known_words().map_or(0, |known_words| known_words.vocabulary.words().len()),
            Self::Sequence(speaker) => speaker.metadata.vocabulary.words().len(),
        }
    }

    /// Vocabulary and table of word vectors; `None` if the model does not read words.
    pub fn known_words(&self) -> Option<KnownWords<'_>> {
        match self {
            Self::Gan(speaker) => speaker.known_words(),
            Self::Sequence(speaker) => Some(speaker.known_words()).filter(|_| speaker.reads_words()),
        }
    }

    /// Normalisation of the training dataset; `None` for a captured skeleton.
    pub fn normalisation(&self) -> Option<&Normalisation> {
        match self {
            Self::Gan(speaker) => Some(&speaker.metadata.normalisation),
            Self::Sequence(speaker) => speaker.metadata.poses.normalisation(),
        }
    }

    /// Architecture of a sequence-to-sequence network; `None` for a GAN.
    pub fn architecture(&self) -> Option<Architecture> {
        match self {
            Self::Gan(_) => None,
            Self::Sequence(speaker) => Some(speaker.metadata.architecture),
        }
    }

    /// Whether the model has a decoder, whose state can be carried from segment to segment.
    pub fn has_state(&self) -> bool {
        matches!(self, Self::Sequence(speaker) if speaker.has_state())
    }

    pub fn reads_words(&self) -> bool {
        self.known_words().is_some()
    }

    /// Words that are not in the vocabulary take their vectors from this table. Fails if the model does not read words,
    /// or if its word vectors have another dimension.
    pub fn set_word_vectors(&mut self, vectors: Arc<WordVectors>) -> Result<()> {
        match self {
            Self::Gan(speaker) => speaker.set_word_vectors(vectors),
            Self::Sequence(speaker) => speaker.set_word_vectors(vectors),
        }
    }

    /// Motion for a sound and its words.
    ///
    /// # Errors
    /// Sound that is too short or of another rate; a model of a captured skeleton.
    pub fn motion(&self, sound: &Sound, words: &[Word]) -> Result<Motion> {
        match self {
            Self::Gan(speaker) => speaker.motion(sound, words),
            Self::Sequence(speaker) => speaker.motion(&speaker.poses(sound, words)?),
        }
    }
}

/// Drop probability as a multiple of the dropout in training. For a speaker of ten minutes trained with a dropout of
/// 0.3, variants correlate with the speech as well as the complete network up to 0.6 (wrist speeds 0.82 and 0.82,
/// wrists 12 mm apart), but not at 0.8 (0.74).
const DROP_FACTOR: f64 = 2.0;
/// Largest drop probability.
const MAX_DROP: f64 = 0.9;

/// Weights of the layer that reads the encoded audio, [out, channels, kernel].
const FIRST_LAYER: &str = "enter.0.conv.weight";

/// Drops random channels of the encoded audio from a checkpoint of `orator train gan`, each with twice the dropout
/// probability of its training; the seed determines which. `prefix` is the prefix of the generator's tensor names.
///
/// # Errors
/// A checkpoint that was trained without dropout, whose variants would only be worse.
pub fn vary(contents: &mut Contents, prefix: &str, seed: u64) -> Result<()> {
    let dropout = contents.facts["settings"]["dropout"].as_f64().unwrap_or(0.0);
    ensure!(
        dropout > 0.0 && dropout < 1.0,
        "it was trained without dropout: omit --seed and --variants, or train with gan.recipe = \"auto\" or a \
         gan.dropout above 0"
    );
    let name = format!("{prefix}{FIRST_LAYER}");
    let Some(weight) = contents.tensors.get_mut(&name) else { anyhow::bail!("tensor {name} is missing") };
    let (_, n_channels, _) = weight.dims3()?;
    let share = (DROP_FACTOR * dropout).min(MAX_DROP);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let factors = (0..n_channels).map(|_| if rng.random_bool(share) { 0.0 } else { 1.0 / (1.0 - share) });
    let factors = Tensor::from_iter(factors, weight.device())?.to_dtype(DType::F32)?.reshape((1, n_channels, 1))?;
    *weight = weight.broadcast_mul(&factors)?;
    Ok(())
}
