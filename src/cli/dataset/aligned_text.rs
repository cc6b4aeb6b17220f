//! A given text whose words get times by alignment with its audio, by either aligner.

use crate::cli::ui::Ui;
use anyhow::{Result, ensure};
use orator_base::stage::progress::Progress;
use orator_base::text::length;
use orator_formats::transcript::{Transcript, Word, WordSource};
use orator_media::aligner::AlignedWord;
use serde_json::{Value, json};
use std::path::Path;

/// Maximum number of unaligned words that a summary lists.
const SHOWN: usize = 8;

/// Words that could not be aligned, with their numbers from 1.
pub(super) type Unaligned = Vec<(usize, Word)>;

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

    /// All words on the clock of the file, and those that could not be aligned; tokens without letters or digits are not
    /// counted. Words without times evenly share the time between their neighbours. `secs` is the length of the audio
    /// and `zero_secs` its start in the file.
    ///
    /// # Errors
    ///
    /// A share of aligned words that `is_enough` rejects: the text probably belongs to other audio than `expected`.
    pub(super) fn with_times(
        &self,
        found: &[Option<AlignedWord>],
        [zero_secs, secs]: [f64; 2],
        is_enough: impl Fn(f64) -> bool,
        expected: &str,
    ) -> Result<(Vec<Word>, Unaligned)> {
        let found = |n: usize| found.get(n).copied().flatten();
        let counted = (0..self.words.len()).filter(|n| has_letters(&self.words[*n]));
        let unaligned: Vec<usize> = counted.clone().filter(|n| found(*n).is_none()).collect();
        let n_words = counted.count();
        let n_aligned = n_words - unaligned.len();
        ensure!(
            is_enough(n_aligned as f64 / n_words as f64),
            "only {n_aligned} of {n_words} words match the {} of audio: expected {expected}",
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
                let confidence = Some(found.confidence);
                let (word, source) = (self.words[n].clone(), WordSource::Aligned);
                words.push(Word { word, start_secs: found.start_secs, end_secs, source, confidence });
            }
        }
        for word in &mut words {
            word.start_secs += zero_secs;
            word.end_secs += zero_secs;
        }
        let unaligned = unaligned.into_iter().map(|n| (n + 1, words[n].clone())).collect();
        Ok((words, unaligned))
    }
}

/// The first unaligned words, for a summary.
pub(super) fn listed(unaligned: &Unaligned) -> String {
    let shown = unaligned.iter().take(SHOWN);
    let shown = shown.map(|(n, word)| format!("word {n} `{}` near {:.1} s", word.word, word.start_secs));
    let more = if unaligned.len() > SHOWN { ", ..." } else { "" };
    shown.collect::<Vec<_>>().join(", ") + more
}

/// All unaligned words, for `--json`.
pub(super) fn facts(unaligned: &Unaligned) -> Value {
    let word = |(n, Word { word, start_secs, end_secs, .. }): &(usize, Word)| json!({ "number": n, "word": word, "start_secs": start_secs, "end_secs": end_secs });
    unaligned.iter().map(word).collect()
}

fn has_letters(text: &str) -> bool {
    text.chars().any(char::is_alphanumeric)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unaligned_words_are_interpolated_between_their_neighbours() {
        let at = |start_secs, end_secs| Some(AlignedWord { start_secs, end_secs, confidence: 0.5 });
        let found = [at(0.0, 0.2), at(0.2, 0.4), None, at(1.0, 1.5), None, None, at(2.5, 3.1), None];
        let words = ["a", "b", "c", "d", "e", "-", "f", "g"].map(str::to_owned).into();
        let text = AlignedText { times: Vec::new(), words };
        let is_enough = |share: f64| share > 0.5;
        let (words, unaligned) = text.with_times(&found, [0.0, 3.0], is_enough, "speech").unwrap();
        let times: Vec<_> = words.iter().map(|word| (word.start_secs, word.end_secs)).collect();
        assert_eq!(times[..4], [(0.0, 0.2), (0.2, 0.4), (0.4, 1.0), (1.0, 1.5)]);
        assert_eq!(times[4..], [(1.5, 2.0), (2.0, 2.5), (2.5, 3.0), (3.0, 3.0)]);
        assert_eq!(unaligned.iter().map(|(n, _)| n - 1).collect::<Vec<_>>(), [2, 4, 7]);
        assert!(unaligned.iter().all(|(n, word)| words[n - 1] == *word && word.source == WordSource::Interpolated));
        assert_eq!((words[3].source, words[3].confidence), (WordSource::Aligned, Some(0.5)));
        let few = text.with_times(&[None, at(1.0, 1.5)], [0.0, 3.0], is_enough, "speech");
        let error = few.unwrap_err().to_string();
        assert!(error.starts_with("only 1 of 7 words match"), "{error}");
    }
}
