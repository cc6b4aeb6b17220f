//! Words of a transcript with their times.

use super::marks;
use anyhow::{Result, ensure};
use serde::{Deserialize, Serialize};

/// A word with its time in seconds from the start of the audio.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Word {
    pub word: String,
    pub start_secs: f64,
    pub end_secs: f64,
    /// Origin of the times.
    pub source: WordSource,
    /// Confidence in the word or its times, 0..1; `None` if the transcript has none.
    pub confidence: Option<f64>,
}

/// Origin of the times of a word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum WordSource {
    /// Stated in the transcript.
    #[default]
    Given,
    /// Share of the time of a sentence, proportional to the number of characters.
    Shared,
    /// Forced alignment of the text with the audio.
    Aligned,
    /// Interpolated between the neighbouring words with times.
    Interpolated,
}

/// Appends the words of `text`, spoken from `start_secs` to `end_secs`, without its marks. Several words share the time
/// in proportion to their number of characters. A `confidence` outside 0..1 is dropped.
pub fn push(
    words: &mut Vec<Word>,
    text: &str,
    (start_secs, end_secs): (f64, f64),
    confidence: Option<f64>,
) -> Result<()> {
    let text = text.trim();
    ensure!(
        start_secs.is_finite() && end_secs.is_finite() && start_secs >= 0.0 && end_secs >= start_secs,
        "invalid times {start_secs:.2} to {end_secs:.2} s of `{}`: expected 0 <= start <= end",
        text.chars().take(40).collect::<String>()
    );
    let confidence = confidence.filter(|confidence| (0.0..=1.0).contains(confidence));
    let spoken = marks::spoken(text);
    let n_letters: usize = spoken.iter().map(|word| word.chars().count()).sum();
    let secs = (end_secs - start_secs) / n_letters.max(1) as f64;
    let is_single_word = text.split_whitespace().nth(1).is_none();
    let (mut n_before, mut at) = (0, start_secs);
    for word in spoken {
        n_before += word.chars().count();
        let until = if n_before == n_letters { end_secs } else { start_secs + secs * n_before as f64 };
        let source = if is_single_word { WordSource::Given } else { WordSource::Shared };
        words.push(Word { word: word.to_owned(), start_secs: at, end_secs: until, source, confidence });
        at = until;
    }
    Ok(())
}
