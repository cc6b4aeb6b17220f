//! Vocabulary with the rules of FineMotion's entry to GENEA 2020: index 0 is padding, 1 an unknown word, followed by
//! the words of the training text in lower case and without a trailing full stop.

use orator_formats::transcript::Word;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

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
    /// Vocabulary of all words of a text.
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

    /// Index of a word as written in a transcript. A word that is unknown with its surrounding punctuation is looked up
    /// without it.
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

#[cfg(test)]
mod tests {
    use super::*;
    use orator_formats::transcript::WordSource;

    #[test]
    fn word_indices_ignore_case_and_full_stops() {
        let word = |text: &str| Word {
            word: text.into(),
            start_secs: 0.5,
            end_secs: 1.0,
            source: WordSource::Given,
            confidence: None,
        };
        let words = [word("The"), word("dog."), word("the"), word(" ")];
        let vocabulary = Vocabulary::of(&words);
        assert_eq!((vocabulary.words().len(), vocabulary.n_indices(), vocabulary.is_sorted()), (2, 4, true));
        assert_eq!(["dog", "DOG.", "the,", "cat", ""].map(|word| vocabulary.number(word)), [2, 2, 3, UNKNOWN, UNKNOWN]);
        let numbered = vocabulary.numbered(&words[1..2]);
        assert_eq!(numbered, [NumberedWord { number: 2, start_secs: 0.5, end_secs: 1.0 }]);
        let numbered = vocabulary.numbered_with(&[word("Cat"), word("dog")], |word| 10 + word.word.len() as u32);
        assert_eq!(numbered.iter().map(|word| word.number).collect::<Vec<_>>(), [13, 2]);
    }
}
