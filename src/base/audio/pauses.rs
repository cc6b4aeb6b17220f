//! Detection of pauses in speech: the level of a sound relative to the level of its speech.

use crate::types::sound::Sound;
use std::ops::Range;

/// Window length of the level in seconds.
const WINDOW_SECS: f64 = 0.01;
/// Half length of the shortest detected pause, seconds.
const HALF_SECS: f64 = 0.06;
/// Fraction of the windows that are not louder than the reference level of speech.
const SPEECH_SHARE: f64 = 0.95;
/// Minimum level of a window with speech, dB relative to the reference level.
const SPEECH_DB: f32 = -25.0;
/// Level of silence, dB.
pub const FLOOR_DB: f32 = -100.0;

/// Level of a sound over time in dB relative to the level of its speech.
#[derive(Clone, Debug)]
pub struct SpeechLevel {
    windows: Vec<f32>,
}

impl SpeechLevel {
    pub fn of(sound: &Sound) -> Self {
        let window = ((WINDOW_SECS * f64::from(sound.rate)) as usize).max(1);
        let level = |part: &[f32]| {
            let mean = part.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>() / part.len() as f64;
            (10.0 * (mean + 1e-10).log10()) as f32
        };
        let mut windows: Vec<f32> = sound.samples.chunks(window).map(level).collect();
        let mut sorted = windows.clone();
        sorted.sort_by(f32::total_cmp);
        let loud = sorted.get(((sorted.len() as f64 * SPEECH_SHARE) as usize).min(sorted.len().saturating_sub(1)));
        let loud = loud.copied().unwrap_or(0.0);
        windows.iter_mut().for_each(|level| *level = (*level - loud).max(FLOOR_DB));
        Self { windows }
    }

    /// Returns the highest level around a time in seconds; silence before the start and after the end.
    pub fn around(&self, secs: f64) -> f32 {
        self.part(secs - HALF_SECS..secs + HALF_SECS).iter().copied().fold(FLOOR_DB, f32::max)
    }

    /// Returns the fraction of a time range in seconds that contains speech.
    pub fn speech_share(&self, secs: Range<f64>) -> f64 {
        let part = self.part(secs);
        part.iter().filter(|level| **level > SPEECH_DB).count() as f64 / part.len().max(1) as f64
    }

    /// Returns the time ranges with speech in seconds, which are divided by pauses of at least `min_pause_secs`.
    pub fn speech_ranges(&self, min_pause_secs: f64) -> Vec<Range<f64>> {
        let mut ranges: Vec<Range<f64>> = Vec::new();
        for (n, _) in self.windows.iter().enumerate().filter(|(_, level)| **level > SPEECH_DB) {
            let window = n as f64 * WINDOW_SECS..(n + 1) as f64 * WINDOW_SECS;
            match ranges.last_mut().filter(|range| window.start - range.end < min_pause_secs) {
                Some(range) => range.end = window.end,
                None => ranges.push(window),
            }
        }
        ranges
    }

    fn part(&self, secs: Range<f64>) -> &[f32] {
        let at = |secs: f64| ((secs / WINDOW_SECS).round().max(0.0) as usize).min(self.windows.len());
        &self.windows[at(secs.start)..at(secs.end)]
    }
}
