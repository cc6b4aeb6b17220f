//! Assignment of a video's transcript words to its samples. A word belongs to the sample that contains its midpoint, so
//! each word is in at most one sample; its times count from the start of that sample.

use super::decisions::{Decision, DecisionAction};
use super::file_name;
use anyhow::{Result, ensure};
use orator_base::stage::ledger::{TranscriptReport, WordCount};
use orator_formats::transcript::{Transcript, TranscriptChoice, Word, WordSource};
use std::path::{Path, PathBuf};

/// Number and share of words that may be after the end of the sound; beyond both, the transcript is of another sound.
const MAX_OUTSIDE: (usize, f64) = (3, 0.1);
/// Tolerance for the end of a word after the end of its sample, seconds: both are rounded.
const ROUNDING_SECS: f64 = 1e-5;

/// Words of a video that are within its sound, with times on the clock of its frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VideoWords {
    /// Words sorted by midpoint.
    words: Vec<Word>,
    account: TranscriptReport,
}

impl VideoWords {
    /// Words of the chosen one of the files `paths`; their sound ends at `sound_secs` on the clock of the transcript,
    /// and `shift_secs` is subtracted from all times to convert from that clock to that of the frames. No file, or none
    /// that can be read, yields no words and a note.
    pub fn of(choice: TranscriptChoice, paths: &[PathBuf], sound_secs: f64, shift_secs: f64) -> Self {
        let TranscriptChoice { found, mut notes, .. } = choice;
        let Some((path, transcript)) = found else {
            if paths.is_empty() {
                notes.push("no transcript has the name of the video".to_owned());
            }
            let file = paths.first().map(|path| file_name(path));
            return Self {
                words: Vec::new(),
                account: TranscriptReport { file, notes, ..TranscriptReport::default() },
            };
        };
        let mut words = Self::new(transcript, &path, sound_secs, shift_secs);
        words.account.notes.splice(0..0, notes);
        words
    }

    /// Words of a transcript that has been read from `path`; the other arguments are those of `of`.
    fn new(transcript: Transcript, path: &Path, sound_secs: f64, shift_secs: f64) -> Self {
        let Transcript { mut words, mut notes, .. } = transcript;
        let n_words = words.len();
        let outside = words.iter().find(|word| midpoint_secs(word) >= sound_secs).cloned();
        words.retain(|word| midpoint_secs(word) < sound_secs);
        let n_outside = n_words - words.len();
        if let Some(first) = outside {
            let (word, secs) = (first.word, first.start_secs);
            notes.push(format!(
                "{n_outside} of {n_words} words lie after the end of the sound and were left out, the first `{word}` at \
                 {secs:.2} s"
            ));
        }
        for word in &mut words {
            word.start_secs -= shift_secs;
            word.end_secs -= shift_secs;
        }
        words.sort_by(|a, b| midpoint_secs(a).total_cmp(&midpoint_secs(b)));
        let count = WordCount { n_words, n_outside, ..WordCount::default() };
        Self { words, account: TranscriptReport { file: Some(file_name(path)), count, notes } }
    }

    /// Applies the decisions on words, in order. A new word has the time of those that it replaces, within the range of
    /// the decision; without any, that of the range.
    #[must_use]
    pub fn corrected(mut self, decisions: &[&Decision]) -> Self {
        for decision in decisions.iter().filter(|decision| decision.action == DecisionAction::Word) {
            let (start, end) = (decision.start_secs, decision.end_secs);
            let is_replaced = |word: &Word| (start..end).contains(&midpoint_secs(word));
            let (replaced, mut words): (Vec<Word>, Vec<Word>) = self.words.into_iter().partition(is_replaced);
            let first = replaced.iter().map(|word| word.start_secs).min_by(f64::total_cmp).unwrap_or(start);
            let last = replaced.iter().map(|word| word.end_secs).max_by(f64::total_cmp).unwrap_or(end);
            if let Some(word) = decision.text.clone().filter(|text| !text.is_empty()) {
                let (start_secs, end_secs) = (first.max(start), last.min(end));
                words.push(Word { word, start_secs, end_secs, source: WordSource::Given, confidence: None });
                words.sort_by(|a, b| midpoint_secs(a).total_cmp(&midpoint_secs(b)));
            }
            self.words = words;
        }
        self.account.count.n_words = self.words.len() + self.account.count.n_outside;
        self
    }

    /// Words of the sample from `start_secs` to `end_secs`, sorted by start; times count from the start of the sample
    /// and are rounded to microseconds.
    pub fn within(&self, start_secs: f64, end_secs: f64) -> Vec<Word> {
        let from = self.words.partition_point(|word| midpoint_secs(word) < start_secs);
        let words = self.words[from..].iter().take_while(|word| midpoint_secs(word) < end_secs);
        let micro = |secs: f64| (secs.clamp(0.0, end_secs - start_secs) * 1e6).round() / 1e6;
        let in_sample = |word: &Word| Word {
            start_secs: micro(word.start_secs - start_secs),
            end_secs: micro(word.end_secs - start_secs),
            ..word.clone()
        };
        let mut words: Vec<Word> = words.map(in_sample).collect();
        words.sort_by(|a, b| a.start_secs.total_cmp(&b.start_secs));
        words
    }

    /// Transcript account with the words counted that are in samples with these start and end times, seconds.
    pub fn report(&self, samples: impl IntoIterator<Item = (f64, f64)>) -> TranscriptReport {
        let n_accepted = samples.into_iter().map(|(start, end)| self.within(start, end).len()).sum();
        let mut account = self.account.clone();
        account.count.n_accepted = n_accepted;
        account.count.n_rejected = self.words.len() - n_accepted.min(self.words.len());
        account
    }
}

/// Transcript of `speaker` in the first usable one of the files `paths`, for a sound that ends at `sound_secs`.
pub fn choose(paths: &[PathBuf], speaker: &str, sound_secs: f64) -> TranscriptChoice {
    TranscriptChoice::first(paths, speaker, |path, transcript| check_end(&transcript.words, path, sound_secs))
}

/// Checks that a transcript does not belong to another sound.
fn check_end(words: &[Word], path: &Path, sound_secs: f64) -> Result<()> {
    let n_words = words.len();
    let n_outside = words.iter().filter(|word| midpoint_secs(word) >= sound_secs).count();
    let last_secs = words.iter().map(|word| word.end_secs).fold(0.0, f64::max);
    ensure!(
        n_outside <= MAX_OUTSIDE.0 || n_outside as f64 <= MAX_OUTSIDE.1 * n_words as f64,
        "{n_outside} of {n_words} words lie after the end of the sound ({sound_secs:.2} s; the last ends at \
         {last_secs:.2} s): is {} the transcript of another sound?",
        file_name(path)
    );
    Ok(())
}

/// Moves a file's words to the clock of its sound and frames, which starts at `start_secs`; earlier ones are removed.
pub fn from_secs(words: &mut Vec<Word>, start_secs: f64) {
    words.retain(|word| start_secs == 0.0 || word.end_secs > start_secs);
    for word in words {
        word.start_secs = (word.start_secs - start_secs).max(0.0);
        word.end_secs -= start_secs;
    }
}

/// Checks the words of a sample of `secs` seconds.
///
/// # Errors
/// A word that is empty, contains whitespace, is outside the sample or out of order, or has an invalid confidence; the
/// message gives its number and text.
pub fn check(words: &[Word], secs: f64) -> Result<()> {
    let mut before = 0.0;
    for (n, word) in words.iter().enumerate() {
        let (start, end) = (word.start_secs, word.end_secs);
        let named = || format!("word {} `{}`, {start:.3} to {end:.3} s", n + 1, word.word);
        ensure!(
            !word.word.is_empty() && !word.word.contains(char::is_whitespace),
            "{}: expected a single word",
            named()
        );
        ensure!(
            start >= 0.0 && end >= start && end <= secs + ROUNDING_SECS,
            "{}: outside its sample of {secs:.3} s",
            named()
        );
        ensure!(start >= before, "{}: it starts before the previous word", named());
        ensure!(
            word.confidence.is_none_or(|c| (0.0..=1.0).contains(&c)),
            "{}: its confidence is not between 0 and 1",
            named()
        );
        before = start;
    }
    Ok(())
}

fn midpoint_secs(word: &Word) -> f64 {
    f64::midpoint(word.start_secs, word.end_secs)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn transcript(rows: &str) -> Transcript {
        Transcript::parse(&rows.replace(' ', "\t"), "tsv", ("", "")).unwrap()
    }

    #[test]
    fn words_before_the_first_frame_are_removed_and_the_others_moved() {
        let mut words = transcript("0.1 0.3 a\n0.9 1.8 b\n2.5 3.0 c\n").words;
        from_secs(&mut words, 1.5);
        let times = |words: &[Word]| {
            words.iter().map(|w| format!("{} {:.1} {:.1}", w.word, w.start_secs, w.end_secs)).collect::<Vec<_>>()
        };
        assert_eq!(times(&words), ["b 0.0 0.3", "c 1.0 1.5"]);
        assert!(check(&words, 1.5).is_ok() && check(&words, 1.2).is_err());
        from_secs(&mut words, 0.0);
        assert_eq!(words.len(), 2);
    }
}
