//! Words as numbers, by the rules of FineMotion's entry to GENEA 2020: 0 is padding, 1 a word that was not trained with,
//! then the words of the training text, in small letters and without a full stop at their end.

use orator_formats::transcript::Word;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Number of padding, which stands where no word is said.
pub const PADDING: u32 = 0;
/// Number of a word that was not trained with.
pub const UNKNOWN: u32 = 1;
/// Numbers before the first word's.
const N_SPECIAL: usize = 2;

/// Words of the training text, sorted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Vocabulary {
    words: Vec<String>,
}

/// Word by its number, with its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberedWord {
    pub number: u32,
    pub start_secs: f64,
    pub end_secs: f64,
}

impl Vocabulary {
    /// All words of a text.
    pub fn of<'w>(words: impl IntoIterator<Item = &'w Word>) -> Self {
        let words: BTreeSet<String> = words.into_iter().map(|word| plain(&word.word)).collect();
        Self { words: words.into_iter().filter(|word| !word.is_empty()).collect() }
    }

    /// Words from number 2 on.
    pub fn words(&self) -> &[String] {
        &self.words
    }

    /// Count of all numbers, with padding and unknown.
    pub fn n_numbers(&self) -> usize {
        N_SPECIAL + self.words.len()
    }

    /// Whether the words are sorted, each there once, as look-up needs them.
    pub fn is_sorted(&self) -> bool {
        self.words.is_sorted_by(|a, b| a < b)
    }

    /// Number of a word as a transcript writes it.
    pub fn number(&self, word: &str) -> u32 {
        self.words.binary_search(&plain(word)).map_or(UNKNOWN, |at| (N_SPECIAL + at) as u32)
    }

    /// Numbers of words with their times, in the order of beginnings.
    pub fn numbered(&self, words: &[Word]) -> Vec<NumberedWord> {
        let number = |word: &Word| NumberedWord {
            number: self.number(&word.word),
            start_secs: word.start_secs,
            end_secs: word.end_secs,
        };
        let mut said: Vec<NumberedWord> = words.iter().map(number).collect();
        said.sort_by(|a, b| a.start_secs.total_cmp(&b.start_secs));
        said
    }

    /// Count of the words that were trained with.
    pub fn n_known(&self, words: &[Word]) -> usize {
        words.iter().filter(|word| self.number(&word.word) != UNKNOWN).count()
    }
}

/// Small letters, no full stop at the end.
fn plain(word: &str) -> String {
    let word = word.trim().to_lowercase();
    word.strip_suffix('.').filter(|rest| !rest.is_empty()).unwrap_or(&word).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_formats::transcript::WordSource;

    #[test]
    fn words_have_numbers_whatever_their_letters() {
        let word = |text: &str| Word {
            word: text.into(),
            start_secs: 0.5,
            end_secs: 1.0,
            source: WordSource::Given,
            confidence: None,
        };
        let words = [word("The"), word("dog."), word("the"), word(" ")];
        let vocabulary = Vocabulary::of(&words);
        assert_eq!((vocabulary.words().len(), vocabulary.n_numbers(), vocabulary.is_sorted()), (2, 4, true));
        assert_eq!(["dog", "DOG.", "the", "cat", ""].map(|word| vocabulary.number(word)), [2, 2, 3, UNKNOWN, UNKNOWN]);
        let said = vocabulary.numbered(&words[1..2]);
        assert_eq!(said, [NumberedWord { number: 2, start_secs: 0.5, end_secs: 1.0 }]);
    }
}
