//! A given text whose words get times by alignment with its audio.

use crate::cli::ui::Ui;
use anyhow::{Result, ensure};
use orator_base::stage::progress::Progress;
use orator_base::text::length;
use orator_formats::transcript::{Transcript, Word, WordSource};
use orator_speech::RecognisedWord;
use std::path::Path;

/// Minimum share of words that must be aligned; with fewer, the text probably belongs to another sound.
const MIN_ALIGNED: f64 = 0.5;

/// Words of a text, in order.
pub(super) struct AlignedText {
    words: Vec<String>,
    /// Given start and end of each word on the clock of the file, seconds; empty without times.
    times: Vec<(f64, f64)>,
}

impl AlignedText {
    /// Reads a transcript. Words with times are searched for near them.
    ///
    /// # Errors
    ///
    /// Those of `Transcript::read`; a transcript without words.
    pub(super) fn read(path: &Path, ui: &Ui) -> Result<Self> {
        let transcript = Transcript::read(path)?;
        if !transcript.words.is_empty() {
            transcript.notes.iter().for_each(|note| ui.say(&format!("{}: {note}", path.display())));
        }
        let words: Vec<String> = transcript.text.split_whitespace().map(str::to_owned).collect();
        ensure!(words.iter().any(|word| has_letters(word)), "the transcript {} contains no words", path.display());
        // If the transcript has word times, the tokens of its text are exactly those words.
        let is_timed = transcript.words.len() == words.len();
        let timed = transcript.words.iter().filter(|_| is_timed);
        Ok(Self { words, times: timed.map(|word| (word.start_secs, word.end_secs)).collect() })
    }

    pub(super) fn words(&self) -> &[String] {
        &self.words
    }

    /// Given times on the clock of audio that starts at `zero_secs` of the file.
    pub(super) fn within(&self, zero_secs: f64) -> Vec<Option<(f64, f64)>> {
        let on_audio = |secs: f64| (secs - zero_secs).max(0.0);
        self.times.iter().map(|(start, end)| Some((on_audio(*start), on_audio(*end)))).collect()
    }

    /// All words, and the indices of those that could not be aligned; tokens without letters or digits are not counted.
    /// Words without times evenly share the time between their neighbours. `secs` is the length of the sound.
    ///
    /// # Errors
    ///
    /// Fewer aligned words than `MIN_ALIGNED`.
    pub(super) fn with_times(&self, found: &[Option<RecognisedWord>], secs: f64) -> Result<(Vec<Word>, Vec<usize>)> {
        let found = |n: usize| found.get(n).and_then(Option::as_ref);
        let counted = (0..self.words.len()).filter(|n| has_letters(&self.words[*n]));
        let unaligned: Vec<usize> = counted.clone().filter(|n| found(*n).is_none()).collect();
        let n_words = counted.count();
        let n_aligned = n_words - unaligned.len();
        ensure!(
            n_aligned as f64 > MIN_ALIGNED * n_words as f64,
            "only {n_aligned} of {n_words} words match the {} of audio: expected the transcript of audible speech, in the \
             language of --language and of the model",
            length(secs)
        );
        let mut words: Vec<Word> = Vec::with_capacity(self.words.len());
        while words.len() < self.words.len() {
            let first = words.len();
            let next = (first..self.words.len()).find_map(|n| Some((n, found(n)?)));
            let (end, until) = next.map_or((self.words.len(), secs), |(n, word)| (n, word.start_secs));
            let start = words.last().map_or(0.0, |word| word.end_secs);
            let step = (until - start).max(0.0) / (end - first).max(1) as f64;
            for (word, n) in self.words[first..end].iter().zip(0..) {
                let [start_secs, end_secs] = [n, n + 1].map(|n| start + step * f64::from(n));
                let source = WordSource::Interpolated;
                words.push(Word { word: word.clone(), start_secs, end_secs, source, confidence: Some(0.0) });
            }
            if let Some((n, found)) = next {
                let end_secs = found.end_secs.min(secs).max(found.start_secs);
                let confidence = Some(f64::from(found.probability));
                let (word, source) = (self.words[n].clone(), WordSource::Aligned);
                words.push(Word { word, start_secs: found.start_secs, end_secs, source, confidence });
            }
        }
        Ok((words, unaligned))
    }
}

fn has_letters(text: &str) -> bool {
    text.chars().any(char::is_alphanumeric)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unaligned_words_are_interpolated_between_their_neighbours() {
        let at =
            |start_secs, end_secs| Some(RecognisedWord { word: String::new(), start_secs, end_secs, probability: 0.5 });
        let found = [at(0.0, 0.2), at(0.2, 0.4), None, at(1.0, 1.5), None, None, at(2.5, 3.1), None];
        let words = ["a", "b", "c", "d", "e", "-", "f", "g"].map(str::to_owned).into();
        let text = AlignedText { times: Vec::new(), words };
        let (words, unaligned) = text.with_times(&found, 3.0).unwrap();
        let times: Vec<_> = words.iter().map(|word| (word.start_secs, word.end_secs)).collect();
        assert_eq!(times[..4], [(0.0, 0.2), (0.2, 0.4), (0.4, 1.0), (1.0, 1.5)]);
        assert_eq!(times[4..], [(1.5, 2.0), (2.0, 2.5), (2.5, 3.0), (3.0, 3.0)]);
        assert_eq!(unaligned, [2, 4, 7]);
        assert!(unaligned.iter().all(|&n| words[n].source == WordSource::Interpolated));
        assert_eq!((words[3].source, words[3].confidence), (WordSource::Aligned, Some(0.5)));
        let error = text.with_times(&[None, at(1.0, 1.5)], 3.0).unwrap_err().to_string();
        assert!(error.starts_with("only 1 of 7 words match"), "{error}");
    }
}
