//! A trained model of either kind, which generates motion of the 49 joints from sound and, for some networks, words.

use super::GestureGenerator;
use super::model::{GenerationChoice, checkpoint_file};
use super::normalisation::Normalisation;
use super::seq2seq::SequenceGenerator;
use super::seq2seq::architecture::{self, Architecture};
use super::seq2seq::metadata::is_sequence_kind;
use anyhow::{Result, bail, ensure};
use orator_base::types::pose3d::Motion;
use orator_base::types::sound::{SAMPLE_RATE, Sound};
use orator_base::types::time::FrameRate;
use orator_formats::checkpoint;
use orator_formats::transcript::Word;
use orator_formats::word_vectors::WordVectors;
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
        Self::open_as(path, &GenerationChoice::default())
    }

    /// Like `open`, for the chosen speaker and variant. Also fails if the network does not have the speaker, or has no
    /// variants.
    pub fn open_as(path: &Path, choice: &GenerationChoice) -> Result<Self> {
        let file = checkpoint_file(path)?;
        let kind = &checkpoint::facts(&file)?["speaker"]["kind"];
        ensure!(
            kind.is_string(),
            "{} is not a checkpoint of `orator train gan` or `orator train seq2seq`",
            file.display()
        );
        if !is_sequence_kind(kind) {
            return Ok(Self::Gan(Box::new(GestureGenerator::open_as(&file, choice)?)));
        }
        let speaker = SequenceGenerator::open(&file)?;
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

    /// Like `open`; selects the speaker of this name if the network has several.
    pub fn open_for(path: &Path, speaker: &str) -> Result<Self> {
        let file = checkpoint_file(path)?;
        let is_of_several = checkpoint::facts(&file)?["other_speakers"].is_array();
        let speaker = is_of_several.then(|| speaker.to_owned());
        Self::open_as(&file, &GenerationChoice { speaker, seed: None })
    }

    /// Name of the speaker.
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

    /// Frame rate of the generated motion.
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
            Self::Gan(_) => 0,
            Self::Sequence(speaker) => speaker.metadata.vocabulary.words().len(),
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

    /// Whether the model reads words.
    pub fn reads_words(&self) -> bool {
        self.architecture().is_some_and(|of| architecture::word_encoder(of).is_some())
    }

    /// Words that are not in the vocabulary take their vectors from this table. Fails if the model does not read words,
    /// or if its word vectors have another dimension.
    pub fn set_word_vectors(&mut self, vectors: Arc<WordVectors>) -> Result<()> {
        match self {
            Self::Gan(speaker) => bail!("the model of {} does not read words: omit --words", speaker.name()),
            Self::Sequence(speaker) => speaker.set_word_vectors(vectors),
        }
    }

    /// Motion for a sound and its words.
    ///
    /// # Errors
    /// Sound that is too short or of another rate; a model of a captured skeleton.
    pub fn motion(&self, sound: &Sound, words: &[Word]) -> Result<Motion> {
        match self {
            Self::Gan(speaker) => speaker.motion(sound),
            Self::Sequence(speaker) => speaker.motion(&speaker.poses(sound, words)?),
        }
    }
}
