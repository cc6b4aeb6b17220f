//! Words of a transcript with their times.

use anyhow::{Result, ensure};
use serde::{Deserialize, Serialize};

/// Word with its time, seconds from the beginning of the sound.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Word {
    pub word: String,
    pub start_secs: f64,
    pub end_secs: f64,
    /// Where the times come from.
    pub source: WordSource,
    /// How sure the word or its times are, 0..1; `None`: the transcript does not say.
    pub confidence: Option<f64>,
}

/// Where the times of a word come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum WordSource {
    /// The transcript times the word.
    #[default]
    Given,
    /// The time of a sentence, shared by its words in proportion to their letters.
    Shared,
    /// Forced alignment of the text with the sound.
    Aligned,
    /// The time between two other words, shared by those that have none.
    Interpolated,
}

/// Adds the words of `text`, said from `start_secs` to `end_secs`: one word has that time, several share it by their
/// letters. `confidence` outside 0..1 is left out. Errors: times that are no span of a sound.
pub fn push(
    words: &mut Vec<Word>,
    text: &str,
    (start_secs, end_secs): (f64, f64),
    confidence: Option<f64>,
) -> Result<()> {
    let text = text.trim();
    ensure!(
        start_secs.is_finite() && end_secs.is_finite() && start_secs >= 0.0 && end_secs >= start_secs,
        "`{}` is said from {start_secs} to {end_secs} s",
        text.chars().take(40).collect::<String>()
    );
    let confidence = confidence.filter(|confidence| (0.0..=1.0).contains(confidence));
    let n_letters: usize = text.split_whitespace().map(|word| word.chars().count()).sum();
    let secs = (end_secs - start_secs) / n_letters.max(1) as f64;
    let is_one = text.split_whitespace().nth(1).is_none();
    let (mut n_before, mut at) = (0, start_secs);
    for word in text.split_whitespace() {
        n_before += word.chars().count();
        let until = if n_before == n_letters { end_secs } else { start_secs + secs * n_before as f64 };
        let source = if is_one { WordSource::Given } else { WordSource::Shared };
        words.push(Word { word: word.to_owned(), start_secs: at, end_secs: until, source, confidence });
        at = until;
    }
    Ok(())
}
