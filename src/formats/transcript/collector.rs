//! Collects the words of a recogniser in file order, and places words without times between their neighbours, within
//! their sentence.

use super::word::{self, Word, WordSource};
use anyhow::{Result, ensure};

/// Words with times, and words that wait for the next time.
#[derive(Debug, Default)]
pub(super) struct WordCollector {
    words: Vec<Word>,
    /// Words without times.
    waiting: Vec<String>,
    /// Time before which no waiting word starts, seconds.
    after_secs: f64,
    /// Whether any time was stated.
    has_times: bool,
}

impl WordCollector {
    /// Starts a sentence: words without times that follow are not placed before it.
    pub(super) fn begin(&mut self, secs: f64) {
        self.place(secs);
        self.after_secs = secs.max(0.0);
    }

    /// Ends a sentence or word: waiting words are placed before `secs`.
    pub(super) fn end(&mut self, secs: f64) {
        self.place(secs);
        self.after_secs = self.after_secs.max(secs);
    }

    /// Adds the words of `text`, spoken from `start` to `end` seconds; one time alone limits the estimated other one.
    pub(super) fn push(
        &mut self,
        text: &str,
        times: (Option<f64>, Option<f64>),
        confidence: Option<f64>,
    ) -> Result<()> {
        if let (Some(start), Some(end)) = times {
            self.place(start);
            word::push(&mut self.words, text, (start, end), confidence)?;
            self.after_secs = end;
            return Ok(());
        }
        if let Some(start) = times.0 {
            self.begin(start);
        }
        self.waiting.extend(super::marks::spoken(text).into_iter().map(str::to_owned));
        if let Some(end) = times.1 {
            self.end(end);
        }
        Ok(())
    }

    /// Number of words with times so far.
    pub(super) fn n_words(&self) -> usize {
        self.words.len()
    }

    /// Sets the origin of the times of the words from index `first` on.
    pub(super) fn set_source(&mut self, first: usize, source: WordSource) {
        self.words.iter_mut().skip(first).for_each(|word| word.source = source);
    }

    /// Appends punctuation to the last word.
    pub(super) fn append(&mut self, punctuation: &str) {
        let last = self.waiting.last_mut().or_else(|| self.words.last_mut().map(|word| &mut word.word));
        if let Some(last) = last {
            last.push_str(punctuation.trim());
        }
    }

    /// All words.
    pub(super) fn finish(mut self) -> Result<Vec<Word>> {
        ensure!(
            self.waiting.is_empty() || self.has_times,
            "word 1: none of the words has times: expected `start` and `end`, or another format of `orator guide dataset`"
        );
        self.place(self.after_secs);
        Ok(self.words)
    }

    /// Spreads the waiting words evenly up to `until` seconds.
    fn place(&mut self, until: f64) {
        self.has_times = true;
        let until = until.max(0.0);
        let start = self.after_secs.min(until);
        let secs = (until - start) / self.waiting.len().max(1) as f64;
        for (nth, word) in self.waiting.drain(..).enumerate() {
            let [start_secs, end_secs] = [nth, nth + 1].map(|n| start + secs * n as f64);
            let (source, confidence) = (WordSource::Interpolated, Some(0.0));
            self.words.push(Word { word, start_secs, end_secs, source, confidence });
        }
    }
}
