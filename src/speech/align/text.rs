//! Alignment of a given text: the sound is recognised window by window, recognised words are matched with the next words
//! of the text and give their times, and words between them that were recognised differently are aligned by force.

use super::matching::{match_units, units_of};
use super::words::{WITHOUT_SPACES, words_of};
use crate::recognise::{EncodedWindow, Recogniser, RecognitionRequest, SampleSource};
use crate::recognised::RecognisedWord;
use crate::spans::{RATE, SpeechSpans};
use anyhow::Result;
use std::ops::Range;

/// Error of given times, seconds.
const WITHIN_SECS: f64 = 5.0;
/// Maximum number of words that are compared with a window, and that number per second without a match before it.
const MAX_WORDS: usize = 300;
const MAX_RATE: f64 = 3.0;
/// End of a window that is recognised again if its words do not match, seconds.
const TAIL_SECS: f64 = 10.0;
/// Words without a match are spoken if they are at most this factor and number more than the recognised words in their
/// place.
const EXTRA: (usize, usize) = (2, 2);
/// Minimum mean probability and length in seconds of a word that was recognised differently.
const MIN_PROBABILITY: f32 = 0.05;
const MIN_SECS: f64 = 0.02;

/// Words of a text with the times that are found.
struct TextWords<'a> {
    words: &'a [String],
    within: &'a [Option<(f64, f64)>],
    found: Vec<Option<RecognisedWord>>,
    /// First word that is not passed.
    next: usize,
}

impl Recogniser {
    /// Finds the times of the words of a text, which are separated by spaces, in a sound of `n_samples` at 16 kHz. `within`
    /// has the range of seconds in which a word is spoken, give or take 5 s, where it is known; it may be empty. The
    /// language is detected in the first window if not given. `progress` is called with the seconds done so far. `None`
    /// for words that do not match the sound.
    ///
    /// # Errors
    /// Those of [`Self::recognise`].
    pub fn align(
        &self,
        source: &mut SampleSource,
        n_samples: usize,
        words: &[String],
        within: &[Option<(f64, f64)>],
        language: Option<&str>,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Vec<Option<RecognisedWord>>> {
        let spans = SpeechSpans::new(std::slice::from_ref(&(0.0..f64::INFINITY)), n_samples);
        let mut request = language.map(|code| self.request(code)).transpose()?;
        let mut text = TextWords { words, within, found: vec![None; words.len()], next: 0 };
        let (mut from, mut matched_secs) = (0, 0.0);
        while let Some(window) = spans.window(from).filter(|_| text.next < words.len()) {
            let window = self.encode(source, window, &spans)?;
            let request = match &mut request {
                Some(request) => request,
                none => none.insert(self.detect_language(&window.audio)?),
            };
            let transcribed = self.transcribe(&window, request, 1, &[])?;
            let [start_secs, end_secs] = window.secs();
            let recognised: Vec<RecognisedWord> =
                transcribed.segments.into_iter().flat_map(|(segment, _)| segment.words).collect();
            let n_words = MAX_WORDS + (MAX_RATE * (start_secs - matched_secs).max(0.0)) as usize;
            let candidates = text.candidates(start_secs, end_secs, n_words);
            let spoken = text.place(candidates, &recognised, &request.language, window.range.end == n_samples);
            self.force(&window, request, &mut text, &spoken)?;
            let last = text.found[..text.next].iter().flatten().last().map_or(0.0, |word| word.end_secs);
            let is_matched = last > start_secs;
            let next_secs = if is_matched {
                last.max(transcribed.next_secs.min(end_secs - TAIL_SECS))
            } else {
                transcribed.next_secs
            };
            matched_secs = matched_secs.max(last);
            let earliest = window.range.start + RATE / 2;
            from = ((next_secs * RATE as f64) as usize).clamp(earliest, window.range.end.max(earliest));
            progress(from as f64 / RATE as f64);
        }
        Ok(text.found)
    }

    /// Times of the words in `spoken` without times, by the times of the tokens of all of these words.
    fn force(
        &self,
        window: &EncodedWindow,
        request: &RecognitionRequest,
        text: &mut TextWords,
        spoken: &[usize],
    ) -> Result<()> {
        if spoken.iter().all(|&word| text.found[word].is_some()) {
            return Ok(());
        }
        let space = if WITHOUT_SPACES.contains(&request.language.as_str()) { "" } else { " " };
        let encode = |word: &usize| self.tokenizer.encode(&format!("{space}{}", text.words[*word]));
        let tokens: Vec<Vec<u32>> = spoken.iter().map(encode).collect();
        let times = self.token_times(window, request, &tokens.concat())?;
        let [start_secs, end_secs] = window.secs();
        let (mut first, mut earliest) = (0, start_secs);
        for (nth, (&word, tokens)) in spoken.iter().zip(&tokens).enumerate() {
            let mut parts = words_of(&self.tokenizer, &request.language, tokens, &times, first);
            parts.iter_mut().for_each(|part| window.correct(part));
            let probability = times.mean_probability(first..first + tokens.len());
            first += tokens.len();
            if let (None, Some(from), Some(to)) = (&text.found[word], parts.first(), parts.last()) {
                let later = spoken[nth..].iter().find_map(|&word| text.found[word].as_ref());
                let latest = later.map_or(end_secs, |word| word.start_secs).max(earliest);
                let [start_secs, end_secs] = [from.start_secs, to.end_secs].map(|secs| secs.clamp(earliest, latest));
                if probability >= MIN_PROBABILITY && end_secs - start_secs >= MIN_SECS {
                    let word_text = text.words[word].clone();
                    text.found[word] = Some(RecognisedWord { word: word_text, start_secs, end_secs, probability });
                }
            }
            earliest = text.found[word].as_ref().map_or(earliest, |word| word.end_secs.max(earliest));
        }
        Ok(())
    }
}

impl TextWords<'_> {
    fn may_be_at(&self, word: usize, start_secs: f64, end_secs: f64) -> bool {
        let within = self.within.get(word).copied().flatten();
        within.is_none_or(|(from, to)| from - WITHIN_SECS < end_secs && start_secs < to + WITHIN_SECS)
    }

    /// Words that may be spoken in a window, at most `n_words`; words that must be spoken before it are passed.
    fn candidates(&mut self, start_secs: f64, end_secs: f64, n_words: usize) -> Range<usize> {
        let is_before = |word: &usize| !self.may_be_at(*word, start_secs, f64::INFINITY);
        self.next += (self.next..self.words.len()).take_while(is_before).count();
        let is_possible = |word: &usize| self.may_be_at(*word, f64::NEG_INFINITY, end_secs);
        self.next..self.next + (self.next..self.words.len()).take(n_words).take_while(is_possible).count()
    }

    /// Gives words the times of recognised words that match, and passes them. Returns all words that are probably spoken:
    /// those and words beside them, in the last window also words after them.
    fn place(
        &mut self,
        candidates: Range<usize>,
        recognised: &[RecognisedWord],
        language: &str,
        is_last: bool,
    ) -> Vec<usize> {
        let start = candidates.start;
        let units = units_of(self.words[candidates.clone()].iter().map(String::as_str), language);
        let recognised_units = units_of(recognised.iter().map(|word| word.word.as_str()), language);
        let pairs = match_units(&units, &recognised_units, |unit, recognised_unit| {
            let word = &recognised[recognised_units[recognised_unit].word];
            self.may_be_at(start + units[unit].word, word.start_secs, word.end_secs)
        });
        // First and last recognised word of each word of which at least half is matched.
        let mut matched: Vec<(usize, usize, usize)> = Vec::new();
        for pairs in pairs.chunk_by(|a, b| units[a.0].word == units[b.0].word) {
            let (word, [first, last]) = (units[pairs[0].0].word, [pairs[0].1, pairs[pairs.len() - 1].1]);
            if 2 * pairs.len() >= units.iter().filter(|unit| unit.word == word).count() {
                matched.push((start + word, recognised_units[first].word, recognised_units[last].word));
            }
        }
        let mut spoken = Vec::new();
        let (mut next, mut next_recognised) = (start, 0);
        let end = (candidates.end, recognised.len(), recognised.len());
        for (word, first, last) in matched.iter().copied().chain([end].into_iter().filter(|_| is_last)) {
            let n_recognised = first.saturating_sub(next_recognised);
            let max_extra = EXTRA.0 * n_recognised + EXTRA.1;
            // Before the first match and after the last, the nearest words; between matches, all or none.
            let is_inner = next > start && word < candidates.end;
            match word.saturating_sub(next) {
                n if n <= max_extra => spoken.extend(next..word),
                _ if is_inner => {}
                _ if word < candidates.end => spoken.extend(word - max_extra..word),
                _ => spoken.extend(next..next + max_extra),
            }
            if let (Some(from), Some(to)) = (recognised.get(first), recognised.get(last)) {
                let probability = recognised[first..=last].iter().map(|word| word.probability).sum::<f32>()
                    / (last + 1 - first) as f32;
                let (word_text, start_secs, end_secs) = (self.words[word].clone(), from.start_secs, to.end_secs);
                self.found[word] = Some(RecognisedWord { word: word_text, start_secs, end_secs, probability });
                spoken.push(word);
                (next, next_recognised) = (word + 1, last + 1);
            }
        }
        self.next = self.next.max(next);
        spoken
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recognised(words: &str) -> Vec<RecognisedWord> {
        let word = |(nth, word): (usize, &str)| RecognisedWord {
            word: word.to_owned(),
            start_secs: nth as f64,
            end_secs: nth as f64 + 0.5,
            probability: 0.5,
        };
        words.split_whitespace().enumerate().map(word).collect()
    }

    fn text<'a>(words: &'a [String], within: &'a [Option<(f64, f64)>]) -> TextWords<'a> {
        TextWords { words, within, found: vec![None; words.len()], next: 0 }
    }

    #[test]
    fn matching_words_get_the_times_of_recognised_words() {
        let words: Vec<String> =
            "The well-known Mr Gutenberg prints, and prints".split(' ').map(str::to_owned).collect();
        let mut text = text(&words, &[]);
        let candidates = text.candidates(0.0, 30.0, 300);
        let spoken = text.place(candidates, &recognised("the well known Mister Gutenburg prints"), "en", false);
        assert_eq!((spoken, text.next), (vec![0, 1, 2, 3, 4], 5));
        let times: Vec<_> =
            text.found.iter().map(|word| word.as_ref().map(|word| (word.start_secs, word.end_secs))).collect();
        assert_eq!(times, [Some((0.0, 0.5)), Some((1.0, 2.5)), None, Some((4.0, 4.5)), Some((5.0, 5.5)), None, None]);
        let candidates = text.candidates(5.5, 30.0, 300);
        assert_eq!(text.place(candidates, &[], "en", true), [5, 6]);
        assert!(text.found[5..].iter().all(Option::is_none));
    }

    #[test]
    fn words_are_searched_for_within_their_ranges() {
        let words: Vec<String> = "one two one two".split(' ').map(str::to_owned).collect();
        let within = [Some((0.0, 2.0)), Some((0.0, 2.0)), Some((20.0, 22.0)), None];
        let mut text = text(&words, &within);
        assert_eq!(text.candidates(0.0, 10.0, 300), 0..2);
        assert_eq!(text.candidates(0.0, 16.0, 3), 0..3);
        assert_eq!(text.candidates(10.0, 16.0, 300), 2..4);
        let mut words = recognised("one two");
        words.iter_mut().for_each(|word| word.end_secs += 20.0);
        assert_eq!(text.place(2..4, &words, "en", false), [2, 3]);
        let mut text = TextWords { next: 2, found: vec![None; 4], ..text };
        assert_eq!(text.place(2..4, &recognised("one two"), "en", false), [2, 3]);
        assert_eq!((text.found[2].is_none(), text.found[3].is_some(), text.next), (true, true, 4));
    }

    #[test]
    fn text_that_is_not_spoken_is_passed() {
        let words: Vec<String> = format!("good morning {} all of you listeners", "unspoken ".repeat(20))
            .split_whitespace()
            .map(str::to_owned)
            .collect();
        let mut text = text(&words, &[]);
        let spoken = text.place(0..words.len(), &recognised("good morning all of you listeners"), "en", true);
        assert_eq!(spoken, [0, 1, 22, 23, 24, 25]);
    }
}
