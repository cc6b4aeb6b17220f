//! Words as network input: their indices and vectors, and for the GAN the word at every pose frame.

use super::seq2seq::architecture::{NumberedWord, UNKNOWN, Vocabulary};
use anyhow::{Result, ensure};
use candle_core::{Device, Tensor};
use orator_base::types::time::FrameRate;
use orator_formats::transcript::Word;
use orator_formats::word_vectors::{WordVectors, table};
use orator_nn::gan::words::{N_TIMES, WordFrames};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Words that a GAN was trained on, in the metadata of its checkpoint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainedWords {
    pub vocabulary: Vocabulary,
    /// Whether a table of word vectors initialised the word embeddings.
    pub has_word_vectors: bool,
}

/// Vocabulary of a network, and a table of vectors for other words.
#[derive(Clone, Copy)]
pub struct KnownWords<'a> {
    pub vocabulary: &'a Vocabulary,
    pub vectors: Option<&'a WordVectors>,
}

impl KnownWords<'_> {
    /// Number of words that take their vectors from the table; `None` without a table.
    pub fn n_from_table<'w>(&self, words: impl IntoIterator<Item = &'w Word>) -> Option<usize> {
        let is_in_table = |word: &&Word| self.table_index(word).is_some();
        self.vectors.map(|_| words.into_iter().filter(is_in_table).count())
    }

    /// Index in the table of word vectors of a word that is not in the vocabulary; `None` if it has no vector.
    fn table_index(&self, word: &Word) -> Option<usize> {
        let vectors = self.vectors.filter(|_| self.vocabulary.number(&word.word) == UNKNOWN)?;
        Some(vectors.index(&word.word)).filter(|index| *index != table::UNKNOWN)
    }

    /// Indices and times of words, sorted by start time, and the vectors [n, dim] of the indices after those of the
    /// vocabulary, if a word has its vector from the table. Fails if the table cannot be read.
    pub fn numbered(&self, words: &[Word]) -> Result<(Vec<NumberedWord>, Option<Tensor>)> {
        let indices: BTreeSet<usize> = words.iter().filter_map(|word| self.table_index(word)).collect();
        let indices: Vec<usize> = indices.into_iter().collect();
        let numbered = self.vocabulary.numbered_with(words, |word| {
            let at = self.table_index(word).and_then(|index| indices.binary_search(&index).ok());
            at.map_or(UNKNOWN, |at| (self.vocabulary.n_indices() + at) as u32)
        });
        let Some(vectors) = self.vectors.filter(|_| !indices.is_empty()) else { return Ok((numbered, None)) };
        let added = indices.iter().map(|index| vectors.vector(*index)).collect::<Result<Vec<_>>>()?.concat();
        Ok((numbered, Some(Tensor::from_vec(added, (indices.len(), vectors.dim()), &Device::Cpu)?)))
    }
}

/// Fails unless a table of word vectors has the dimension `dim` of the word embeddings of the model `name`, which were
/// initialised from such a table.
pub fn check_vectors(name: &str, has_word_vectors: bool, dim: usize, vectors: &WordVectors) -> Result<()> {
    ensure!(
        has_word_vectors,
        "the model of {name} was trained without a table of word vectors (`orator train gan --words` or `orator train \
         seq2seq --words`): omit --words"
    );
    ensure!(
        vectors.dim() == dim,
        "the word vectors in {} have {} dimensions, those of the model of {name} {dim}: expected the table that it was \
         trained with",
        vectors.path().display(),
        vectors.dim()
    );
    Ok(())
}

/// Collects the words at the frames of a batch of sounds of equal length.
#[derive(Default)]
pub struct WordFrameList {
    numbers: Vec<u32>,
    times: Vec<f32>,
    n_sounds: usize,
}

impl WordFrameList {
    /// Appends a sound with frames at `secs`: at each the last word that has begun by half a frame later, unless it has
    /// ended half a frame before. Every word is thus at one frame at least, unless another word begins there.
    pub fn push(&mut self, spoken: &[NumberedWord], fps: FrameRate, secs: impl IntoIterator<Item = f64>) {
        let half = 0.5 * fps.secs(1);
        for secs in secs {
            let n_begun = spoken.partition_point(|word| word.start_secs < secs + half);
            let word = n_begun.checked_sub(1).map(|last| spoken[last]).filter(|word| word.end_secs > secs - half);
            self.numbers.push(word.map_or(0, |word| word.number));
            let times = word.map_or([0.0; N_TIMES], |word| [secs - word.start_secs, word.end_secs - secs]);
            self.times.extend(times.map(|secs| secs.max(0.0) as f32));
        }
        self.n_sounds += 1;
    }

    /// The batch; `added` has the vectors of the indices after those of the vocabulary.
    pub fn frames(self, added: Option<Tensor>) -> Result<WordFrames> {
        let (n, n_frames) = (self.n_sounds, self.numbers.len() / self.n_sounds.max(1));
        Ok(WordFrames {
            numbers: Tensor::from_vec(self.numbers, (n, n_frames), &Device::Cpu)?,
            times: Tensor::from_vec(self.times, (n, n_frames, N_TIMES), &Device::Cpu)?,
            added,
        })
    }
}
