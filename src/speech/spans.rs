//! Ranges of a sound with speech, and the windows that cover them.

use crate::mel::WINDOW_SAMPLES;
use std::ops::Range;

/// Samples per second.
pub(crate) const RATE: usize = 16_000;
/// Samples of a spectrogram's frame, on which windows start.
pub(crate) const HOP: usize = 160;
/// Seconds around detected speech that belong to it.
const PADDING_SECS: f64 = 0.4;
/// Silence that ends a window, samples.
const MAX_GAP: usize = 5 * RATE;
/// Length of the shortest window, samples.
const MIN_WINDOW: usize = RATE / 4;

/// Ranges of samples with speech: in order, not touching each other, within the sound.
pub(crate) struct SpeechSpans(Vec<Range<usize>>);

impl SpeechSpans {
    /// From ranges in seconds, in any order, of a sound of `n_samples`.
    pub(crate) fn new(speech: &[Range<f64>], n_samples: usize) -> Self {
        let at = |secs: f64| (secs * RATE as f64).clamp(0.0, n_samples as f64) as usize;
        let padded = |range: &Range<f64>| at(range.start - PADDING_SECS) / HOP * HOP..at(range.end + PADDING_SECS);
        let mut ranges: Vec<Range<usize>> = speech.iter().filter(|range| range.start < range.end).map(padded).collect();
        ranges.sort_unstable_by_key(|range| range.start);
        let mut spans: Vec<Range<usize>> = Vec::new();
        for range in ranges {
            match spans.last_mut() {
                Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
                _ => spans.push(range),
            }
        }
        Self(spans)
    }

    /// The next window of at most 30 s with speech from sample `from` on.
    pub(crate) fn window(&self, from: usize) -> Option<Range<usize>> {
        let mut spans = self.0.iter().skip_while(|span| span.end < from + MIN_WINDOW).peekable();
        let start = spans.peek()?.start.max(from);
        let mut end = start;
        for span in spans.take_while(|span| span.start < start + WINDOW_SAMPLES) {
            if end > start && span.start > end + MAX_GAP {
                break;
            }
            end = span.end;
        }
        Some(start..end.min(start + WINDOW_SAMPLES))
    }

    /// Replaces samples without speech, of which the first is number `start`, and those that are not finite, by zeros.
    pub(crate) fn silence(&self, samples: &mut [f32], start: usize) {
        let n = samples.len();
        let mut silent = 0;
        let end = start + n..start + n;
        for span in self.0.iter().chain([&end]) {
            let [from, to] = [span.start, span.end].map(|at| at.saturating_sub(start).min(n));
            samples[silent.min(from)..from].fill(0.0);
            silent = silent.max(to);
        }
        samples.iter_mut().filter(|sample| !sample.is_finite()).for_each(|sample| *sample = 0.0);
    }

    /// Whether speech was detected within a range of seconds.
    pub(crate) fn overlap(&self, start_secs: f64, end_secs: f64) -> bool {
        let [start, end] = [start_secs, end_secs].map(|secs| secs * RATE as f64);
        self.0.iter().any(|span| (span.start as f64) < end && start < span.end as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_cover_the_speech() {
        let second = |secs: f64| (secs * RATE as f64) as usize;
        let spans =
            SpeechSpans::new(&[50.0..51.0, 1.0..2.0, 2.5..4.0, f64::NAN..3.0, 6.0..5.0, 43.0..90.0], second(60.0));
        assert_eq!(spans.0, [second(0.6)..second(4.4), second(42.6)..second(60.0)]);
        assert_eq!(spans.window(0), Some(second(0.6)..second(4.4)));
        assert_eq!(spans.window(second(2.0)), Some(second(2.0)..second(4.4)));
        assert_eq!(spans.window(second(4.2)), Some(second(42.6)..second(60.0)));
        assert_eq!(spans.window(second(59.8)), None);
        assert_eq!(
            SpeechSpans::new(std::slice::from_ref(&(0.0..90.0)), second(60.0)).window(second(9.0)),
            Some(second(9.0)..second(39.0))
        );
        let near = SpeechSpans::new(&[0.0..1.0, 5.0..6.0, 35.0..36.0], second(60.0));
        assert_eq!(near.window(0), Some(0..second(6.4)));
        assert!(near.overlap(6.2, 9.0) && !near.overlap(7.0, 9.0) && !near.overlap(f64::NAN, 9.0));
        assert!(SpeechSpans::new(&[], 100).window(0).is_none());
    }

    #[test]
    fn samples_without_speech_are_silenced() {
        let spans = SpeechSpans::new(&[1.0..2.0, 3.0..4.0], 10 * RATE);
        let mut samples = vec![1.0; 6 * RATE];
        samples[RATE] = f32::NAN;
        spans.silence(&mut samples, RATE / 2);
        let at = |secs: f64| samples[(secs * RATE as f64) as usize - RATE / 2];
        assert_eq!(
            [0.55, 0.7, 1.5, 2.3, 2.5, 2.7, 4.3, 4.5, 6.4].map(at),
            [0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0]
        );
        let mut none = vec![1.0; 10];
        SpeechSpans::new(&[], 10).silence(&mut none, 0);
        assert_eq!(none, [0.0; 10]);
    }
}
