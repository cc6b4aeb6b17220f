//! The network architectures: sizes for a frame rate, construction, and the words and audio features of a segment. The
//! vocabulary follows FineMotion's entry to GENEA 2020: index 0 is padding, 1 an unknown word, followed by the words of
//! the training text in lower case and without a trailing full stop.

use candle_core::{Device, Result, Tensor};
use ndarray::Array2;
use orator_base::audio::mfcc::{self, N_CEPSTRA};
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
pub use orator_dataset::config::SequenceNetwork as Architecture;
use orator_formats::transcript::Word;
use orator_nn::params::Params;
use orator_nn::seq2seq::autoencoder::AudioBaseline;
use orator_nn::seq2seq::config::Config;
use orator_nn::seq2seq::networks::{ContextSeq2Seq, WordsSeq2Seq};
use orator_nn::seq2seq::predict::GesturePredictor;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Seconds of motion predicted per segment.
const PREDICTED_SECS: f64 = 1.0;
/// Seconds of previous poses that a segment starts from.
const PREVIOUS_SECS: f64 = 0.5;
/// Seconds of audio context on either side of a pose.
const AUDIO_CONTEXT_SECS: f64 = 1.5;
/// Word context of `contextual` on either side of a pose, seconds.
pub const AROUND_POSE_SECS: f64 = 1.5;
/// Word context of `words` on either side of a segment in the authors' code, seconds.
pub const AROUND_SEGMENT_SECS: f64 = 2.0;
/// Tolerance of word times against rounding errors, seconds.
const ROUNDING_SECS: f64 = 1e-6;

/// Network configuration for a frame rate, with published values for everything else: `pose` features per pose,
/// `vocabulary` word indices with embeddings of dimension `word`, and hidden states of dimension `hidden`.
pub fn network_config(fps: FrameRate, pose: usize, vocabulary: usize, [hidden, word]: [usize; 2]) -> Config {
    let frames = |secs: f64| ((secs * fps.per_sec()).round() as usize).max(2);
    Config {
        pose,
        audio: N_CEPSTRA,
        context: 2 * frames(AUDIO_CONTEXT_SECS) + 1,
        previous: frames(PREVIOUS_SECS),
        predicted: frames(PREDICTED_SECS),
        hidden,
        vocabulary,
        word,
        ..Config::default()
    }
}

/// Builds a network, and adds its tensors to `params`.
pub fn network(of: Architecture, params: &mut Params, config: &Config) -> Result<Box<dyn GesturePredictor>> {
    Ok(match of {
        Architecture::Contextual => Box::new(ContextSeq2Seq::new(params, config)?),
        Architecture::Words => Box::new(WordsSeq2Seq::new(params, config)?),
        Architecture::Audio => Box::new(WordsSeq2Seq::audio_only(params, config)?),
        Architecture::Adversarial => Box::new(WordsSeq2Seq::without_words(params, config)?),
        Architecture::Autoencoder => Box::new(AudioBaseline::new(params, config)?),
    })
}

/// Name of the encoder with the word embedding table; `None` if the network does not read words.
pub fn word_encoder(of: Architecture) -> Option<&'static str> {
    matches!(of, Architecture::Contextual | Architecture::Words).then_some("word_encoder")
}

/// Word indices that the network reads for a segment whose first predicted pose is `first`: one row per pose
/// (`contextual`), one row of the words up to `around` seconds around the segment (`words`), or no row. `spoken_words`
/// are sorted by start time.
pub fn words(
    of: Architecture,
    spoken_words: &[NumberedWord],
    [first, predicted]: [usize; 2],
    fps: FrameRate,
    around: f64,
) -> Vec<Vec<u32>> {
    let within = |start: f64, end: f64| {
        let (start, end) = (start - ROUNDING_SECS, end + ROUNDING_SECS);
        let first = spoken_words.partition_point(|word| word.start_secs < start);
        let started = spoken_words[first..].iter().take_while(|word| word.start_secs <= end);
        started.filter(|word| word.end_secs <= end).map(|word| word.number).collect::<Vec<u32>>()
    };
    match of {
        Architecture::Contextual => (first..first + predicted)
            .map(|t| within(fps.secs(t) - AROUND_POSE_SECS, fps.secs(t) + AROUND_POSE_SECS))
            .collect(),
        Architecture::Words => {
            let (start, end) = (fps.secs(first), fps.secs(first + predicted));
            vec![within(start - around, end + around)]
        }
        Architecture::Audio | Architecture::Adversarial | Architecture::Autoencoder => Vec::new(),
    }
}

/// Batch of the words of segments, padded at the end to the longest row and at least one word: [B, predicted, W]
/// (`contextual`) or [B, W] (`words`); `None` for networks without words.
pub fn words_tensor(of: Architecture, segments: &[Vec<Vec<u32>>]) -> Result<Option<Tensor>> {
    let rows = || segments.iter().flatten();
    let n_words = rows().map(Vec::len).max().unwrap_or(0).max(1);
    let padded = rows().flat_map(|row| row.iter().copied().chain(std::iter::repeat(PADDING)).take(n_words));
    let indices: Vec<u32> = padded.collect();
    let n_rows = segments.first().map_or(0, Vec::len);
    match of {
        Architecture::Contextual => {
            Tensor::from_vec(indices, (segments.len(), n_rows, n_words), &Device::Cpu).map(Some)
        }
        Architecture::Words => Tensor::from_vec(indices, (segments.len(), n_words), &Device::Cpu).map(Some),
        Architecture::Audio | Architecture::Adversarial | Architecture::Autoencoder => Ok(None),
    }
}

/// Supported sample rates, Hz.
pub const RATES: std::ops::RangeInclusive<u32> = 8_000..=48_000;

/// Cepstra of a sound for `n_frames` poses, padded with silence to `n_padded` frames and by half a context on either
/// side: [n_padded + context - 1, 26].
pub fn audio_features(sound: &Sound, fps: FrameRate, n_frames: usize, n_padded: usize, context: usize) -> Array2<f32> {
    let silence = mfcc::silence(sound.rate);
    let features = mfcc::of_poses(&sound.samples, sound.rate, fps.per_sec(), n_frames);
    let at = |(t, c): (usize, usize)| if t < n_frames { features[[t, c]] } else { silence[c] };
    mfcc::with_context(&Array2::from_shape_fn((n_padded, N_CEPSTRA), at), context, &silence)
}

/// Index of padding, where there is no word.
pub const PADDING: u32 = 0;
/// Index of words that are not in the vocabulary.
pub const UNKNOWN: u32 = 1;
/// Number of indices before that of the first word.
const N_SPECIAL: usize = 2;

/// Sorted words of the training text.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Vocabulary {
    words: Vec<String>,
}

/// Index of a spoken word with its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberedWord {
    pub number: u32,
    pub start_secs: f64,
    pub end_secs: f64,
}

impl Vocabulary {
    pub fn of<'w>(words: impl IntoIterator<Item = &'w Word>) -> Self {
        let words: BTreeSet<String> = words.into_iter().map(|word| canonical(&word.word)).collect();
        Self { words: words.into_iter().filter(|word| !word.is_empty()).collect() }
    }

    /// Words in the order of their indices, from index 2 on.
    pub fn words(&self) -> &[String] {
        &self.words
    }

    /// Number of indices, including those of padding and of unknown words.
    pub fn n_indices(&self) -> usize {
        N_SPECIAL + self.words.len()
    }

    /// Whether the words are sorted and unique, as binary search requires.
    pub fn is_sorted(&self) -> bool {
        self.words.is_sorted_by(|a, b| a < b)
    }

    /// Index of a word as written in a transcript. A word unknown with its punctuation is looked up without it.
    pub fn number(&self, word: &str) -> u32 {
        let word = canonical(word);
        let bare = word.trim_matches(|character: char| !character.is_alphanumeric());
        let found = [&*word, bare].into_iter().find_map(|word| self.words.binary_search_by(|of| (**of).cmp(word)).ok());
        found.map_or(UNKNOWN, |at| (N_SPECIAL + at) as u32)
    }

    /// Indices and times of words, sorted by start time.
    pub fn numbered(&self, words: &[Word]) -> Vec<NumberedWord> {
        self.numbered_with(words, |_| UNKNOWN)
    }

    /// Like `numbered`; `other` returns the index of a word that is not in the vocabulary.
    pub fn numbered_with(&self, words: &[Word], other: impl Fn(&Word) -> u32) -> Vec<NumberedWord> {
        let number = |word: &Word| NumberedWord {
            number: match self.number(&word.word) {
                UNKNOWN => other(word),
                number => number,
            },
            start_secs: word.start_secs,
            end_secs: word.end_secs,
        };
        let mut numbered: Vec<NumberedWord> = words.iter().map(number).collect();
        numbered.sort_by(|a, b| a.start_secs.total_cmp(&b.start_secs));
        numbered
    }

    /// Number of the given words that are in the vocabulary.
    pub fn n_known(&self, words: &[Word]) -> usize {
        words.iter().filter(|word| self.number(&word.word) != UNKNOWN).count()
    }
}

/// Lower case word without a trailing full stop.
fn canonical(word: &str) -> String {
    let word = word.trim().to_lowercase();
    word.strip_suffix('.').filter(|rest| !rest.is_empty()).unwrap_or(&word).to_owned()
}
