//! Word times for a transcript, by forced alignment with its sound.

use anyhow::{Result, ensure};
use orator_base::text::length;
use orator_base::types::sound::SAMPLE_RATE;
use orator_formats::transcript::{Transcript, Word, WordSource};
use orator_media::aligner::{AlignedWord, Aligner, SpokenWord};
use orator_media::ffmpeg::sound_stream::SoundStream;
use orator_media::ffmpeg::{UnreadableMedia, origin};
use std::path::Path;

/// Minimum share of words that must be aligned; with fewer, the transcript probably belongs to another sound.
const MIN_ALIGNED: f64 = 0.25;

/// Words with times, and the words that could not be aligned.
#[derive(Clone, Debug, PartialEq)]
pub struct Alignment {
    /// All words of the text in order: aligned, or interpolated with confidence 0 if alignment failed.
    pub words: Vec<Word>,
    /// Indices of the words that could not be aligned; tokens without letters or digits are not counted.
    pub unaligned: Vec<usize>,
    /// Length of the sound, seconds.
    pub sound_secs: f64,
}

/// Aligns the words of a transcript with the sound in the file `sound`. Words that already have times are searched for
/// within them. `on_progress` is called with the seconds of each processed piece of sound.
///
/// # Errors
/// A transcript without words, a file without sound, fewer aligned words than `MIN_ALIGNED`.
pub fn align(
    aligner: Aligner,
    sound: &Path,
    transcript: &Transcript,
    mut on_progress: impl FnMut(f64),
) -> Result<Alignment> {
    let texts: Vec<&str> = transcript.text.split_whitespace().collect();
    let n_words = texts.iter().filter(|text| has_letters(text)).count();
    ensure!(n_words > 0, "the transcript contains no words");
    // The sound starts with the first picture; transcripts use the clock of the file.
    let zero_secs = origin::start_secs(sound)?;
    let on_sound_clock = |secs: f64| (secs - zero_secs).max(0.0);
    let within = |nth: usize| {
        transcript.words.get(nth).map(|word| (on_sound_clock(word.start_secs), on_sound_clock(word.end_secs)))
    };
    // If the transcript has word times, the tokens of its text are exactly those words.
    let is_timed = transcript.words.len() == texts.len();
    let spoken = texts
        .iter()
        .enumerate()
        .map(|(nth, text)| SpokenWord { word: (*text).to_owned(), within: within(nth).filter(|_| is_timed) });
    let spoken: Vec<SpokenWord> = spoken.collect();
    let mut n_samples = 0;
    let found = aligner.align(&spoken, |take| {
        for piece in SoundStream::open(sound, SAMPLE_RATE) {
            let piece = piece?;
            n_samples += piece.len();
            on_progress(piece.len() as f64 / f64::from(SAMPLE_RATE));
            take(&piece)?;
        }
        match n_samples {
            0 => Err(UnreadableMedia(format!("{} has no audio", sound.display())).into()),
            _ => Ok(()),
        }
    })?;
    let unaligned: Vec<usize> = (0..texts.len()).filter(|&n| found[n].is_none() && has_letters(texts[n])).collect();
    let n_aligned = n_words - unaligned.len();
    let sound_secs = n_samples as f64 / f64::from(SAMPLE_RATE);
    ensure!(
        n_aligned as f64 >= MIN_ALIGNED * n_words as f64,
        "only {n_aligned} of {n_words} words match the {} of audio: expected the English transcript of audible speech",
        length(sound_secs)
    );
    let mut words = with_times(&texts, &found, sound_secs);
    for word in &mut words {
        word.start_secs += zero_secs;
        word.end_secs += zero_secs;
    }
    Ok(Alignment { words, unaligned, sound_secs })
}

fn has_letters(text: &str) -> bool {
    text.chars().any(char::is_alphanumeric)
}

/// Combines texts and times; words without times evenly share the time between their neighbours.
fn with_times(texts: &[&str], found: &[Option<AlignedWord>], sound_secs: f64) -> Vec<Word> {
    let mut words: Vec<Word> = Vec::with_capacity(texts.len());
    while words.len() < texts.len() {
        let first = words.len();
        let start = words.last().map_or(0.0, |word| word.end_secs);
        let n_untimed = found[first..].iter().take_while(|found| found.is_none()).count();
        let until = found.get(first + n_untimed).copied().flatten().map_or(sound_secs, |next| next.start_secs);
        let secs = (until - start).max(0.0) / n_untimed.max(1) as f64;
        for nth in 0..n_untimed {
            let [start_secs, end_secs] = [nth, nth + 1].map(|n| start + secs * n as f64);
            let (word, source) = (texts[first + nth].to_owned(), WordSource::Interpolated);
            words.push(Word { word, start_secs, end_secs, source, confidence: Some(0.0) });
        }
        if let Some(Some(AlignedWord { start_secs, end_secs, confidence })) = found.get(first + n_untimed).copied() {
            let (word, source) = (texts[first + n_untimed].to_owned(), WordSource::Aligned);
            let end_secs = end_secs.min(sound_secs).max(start_secs);
            words.push(Word { word, start_secs, end_secs, source, confidence: Some(confidence) });
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unaligned_words_are_interpolated_between_their_neighbours() {
        let at = |start_secs, end_secs| Some(AlignedWord { start_secs, end_secs, confidence: 0.9 });
        let found = [None, at(1.0, 1.5), None, None, at(2.5, 3.1), None];
        let words = with_times(&["a", "b", "c", "d", "e", "f"], &found, 3.0);
        let times: Vec<_> = words.iter().map(|word| (word.start_secs, word.end_secs)).collect();
        assert_eq!(times, [(0.0, 1.0), (1.0, 1.5), (1.5, 2.0), (2.0, 2.5), (2.5, 3.0), (3.0, 3.0)]);
        let unaligned: Vec<usize> = (0..6).filter(|&n| words[n].confidence == Some(0.0)).collect();
        assert_eq!(unaligned, [0, 2, 3, 5]);
        assert!(unaligned.iter().all(|&n| words[n].source == WordSource::Interpolated));
    }
}
