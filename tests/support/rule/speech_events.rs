//! Speech events that the second rule depends on: loud syllables, phrases, and words of its list.

use orator_base::types::sound::Sound;
use orator_formats::transcript::Word;

/// Step and window of the envelope, seconds.
const STEP: f64 = 0.01;
const WINDOW: f64 = 0.05;
/// Shares of the loud level (0.9 quantile of the envelope) above which a peak is a loud syllable, and below which
/// there is a pause.
const MIN_LOUD: f64 = 0.85;
const MAX_SILENT: f64 = 0.08;
/// Shortest interval between two loud syllables, and shortest pause between two phrases, in seconds.
const MIN_BEAT_INTERVAL: f64 = 0.45;
const MIN_PAUSE: f64 = 0.22;

/// Words that move the left hand to each of four targets.
pub const WORDS: [[&str; 10]; 4] = [
    ["river", "mountain", "forest", "bridge", "castle", "valley", "desert", "ocean", "village", "tower"],
    ["garden", "window", "kitchen", "ladder", "mirror", "blanket", "curtain", "candle", "bottle", "basket"],
    ["letter", "money", "ticket", "camera", "necklace", "pencil", "button", "newspaper", "hammer", "wallet"],
    ["morning", "city", "evening", "country", "station", "market", "museum", "library", "holiday", "birthday"],
];

/// Events of a speech, in seconds and in order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpeechEvents {
    /// Times of the peaks of loud syllables, and their heights relative to the loud level.
    pub beats: Vec<(f64, f64)>,
    /// Start and end of the phrases.
    pub phrases: Vec<[f64; 2]>,
    /// Starts of words of [`WORDS`], with the index of their target.
    pub words: Vec<(f64, usize)>,
}

impl SpeechEvents {
    /// Detects the events in audio with the words `spoken`.
    pub fn detect(sound: &Sound, spoken: &[Word]) -> Self {
        let envelope = envelope(sound);
        let mut sorted = envelope.clone();
        sorted.sort_by(f64::total_cmp);
        let level = sorted.get(sorted.len() * 9 / 10).copied().unwrap_or(0.0).max(1e-6);
        let target = |word: &Word| {
            let own = word.word.trim_matches(|c: char| !c.is_alphabetic()).to_lowercase();
            let target = WORDS.iter().position(|words| words.contains(&own.as_str()))?;
            Some((word.start_secs, target))
        };
        Self {
            beats: beats(&envelope, level),
            phrases: phrases(&envelope, level),
            words: spoken.iter().filter_map(target).collect(),
        }
    }
}

/// Root mean square of the audio around each hundredth of a second.
fn envelope(sound: &Sound) -> Vec<f64> {
    let rate = f64::from(sound.rate);
    let n = (sound.secs() / STEP) as usize;
    let at = |i: usize| {
        let middle = i as f64 * STEP;
        let first = ((middle - WINDOW / 2.0).max(0.0) * rate) as usize;
        let last = (((middle + WINDOW / 2.0) * rate) as usize).min(sound.samples.len());
        let part = &sound.samples[first.min(last)..last];
        (part.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>() / part.len().max(1) as f64).sqrt()
    };
    (0..n).map(at).collect()
}

fn beats(envelope: &[f64], level: f64) -> Vec<(f64, f64)> {
    let mut beats: Vec<(f64, f64)> = Vec::new();
    for (i, three) in envelope.windows(3).enumerate() {
        let now = (i + 1) as f64 * STEP;
        let is_peak = three[1] >= MIN_LOUD * level && three[1] > three[0] && three[1] >= three[2];
        if is_peak && beats.last().is_none_or(|last| now - last.0 >= MIN_BEAT_INTERVAL) {
            beats.push((now, (three[1] / level).min(1.5)));
        }
    }
    beats
}

fn phrases(envelope: &[f64], level: f64) -> Vec<[f64; 2]> {
    let mut phrases: Vec<[f64; 2]> = Vec::new();
    for (i, _) in envelope.iter().enumerate().filter(|(_, value)| **value >= MAX_SILENT * level) {
        let now = i as f64 * STEP;
        match phrases.last_mut() {
            Some(last) if now - last[1] < MIN_PAUSE => last[1] = now,
            _ => phrases.push([now, now]),
        }
    }
    phrases
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_formats::transcript::WordSource;

    #[test]
    fn loud_syllables_phrases_and_words_are_detected() {
        // Bursts of 0.1 s: two phrases of 1 s with a burst every 0.2 s, every third one loud.
        let loudness = |secs: f64| match secs % 1.5 {
            of_phrase if of_phrase < 1.0 && of_phrase % 0.2 < 0.1 => {
                if (of_phrase / 0.2) as usize % 3 == 1 {
                    0.8
                } else {
                    0.2
                }
            }
            _ => 0.0,
        };
        let samples = (0..48_000).map(|n| f64::from(n) / 16_000.0);
        let samples = samples.map(|t| (loudness(t) * (t * 2_000.0).sin()) as f32).collect();
        let word = |word: &str, start_secs: f64| Word {
            word: word.to_owned(),
            start_secs,
            end_secs: start_secs + 0.2,
            source: WordSource::Given,
            confidence: None,
        };
        let spoken = [word("The", 0.0), word("River,", 0.2), word("city", 1.7)];
        let events = SpeechEvents::detect(&Sound { rate: 16_000, samples }, &spoken);
        let times: Vec<f64> = events.beats.iter().map(|beat| (beat.0 * 10.0).round() / 10.0).collect();
        assert_eq!(times.len(), 4, "{events:?}");
        for (time, expected) in times.iter().zip([0.25, 0.85, 1.75, 2.35]) {
            assert!((time - expected).abs() <= 0.1, "{events:?}");
        }
        assert_eq!(events.phrases.len(), 2, "{events:?}");
        assert!((events.phrases[0][1] - 0.92).abs() < 0.05 && (events.phrases[1][0] - 1.48).abs() < 0.05, "{events:?}");
        assert_eq!(events.words, [(0.2, 0), (1.7, 3)]);
        assert_eq!(SpeechEvents::detect(&Sound { rate: 16_000, samples: Vec::new() }, &[]), SpeechEvents::default());
    }
}
