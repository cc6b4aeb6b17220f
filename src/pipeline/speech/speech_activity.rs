//! Speech activity: the speech model's probabilities per window are converted to speech segments by hysteresis, and
//! these to the share of speech around each frame, or to the time ranges that are transcribed. Memory: one value per
//! 32 ms window.

use crate::sound;
use anyhow::{Context, Result, ensure};
use orator_base::math::runs::true_ranges;
use orator_base::types::time::FrameRate;
use orator_onnx::speech::{SpeechModel, WINDOW};
use std::ops::Range;
use std::path::Path;

/// Window around a frame in seconds: about a sentence with its pauses.
const WINDOW_SECS: f64 = 4.0;
/// Hysteresis thresholds: speech starts at the first probability and ends below the second (Silero's, as the next two).
const START_PROBABILITY: f32 = 0.5;
const END_PROBABILITY: f32 = 0.35;
/// Longest silence within speech, and shortest speech, in seconds.
const HANGOVER_SECS: f64 = 0.1;
const MIN_SPEECH_SECS: f64 = 0.25;
/// Sample rate, Hz.
const RATE: u32 = orator_base::types::sound::SAMPLE_RATE;

/// Share of speech, 0..1, in the 4 s around each frame, from the audio file `path`; NaN for frames without audio.
///
/// # Errors
/// A file that is not 16-bit audio at 16 kHz; a model that fails.
pub fn shares(path: &Path, model: &mut SpeechModel, fps: FrameRate, n_frames: usize) -> Result<Vec<f32>> {
    let probabilities = if path.exists() { probabilities(path, model)? } else { Vec::new() };
    Ok(shares_of(&is_speech(&probabilities), fps, n_frames))
}

/// Ranges with speech in the audio file `path`, seconds; the last window may be longer than the audio.
///
/// # Errors
/// Those of `shares`.
pub fn ranges(path: &Path, model: &mut SpeechModel) -> Result<Vec<Range<f64>>> {
    Ok(ranges_of(&is_speech(&probabilities(path, model)?)))
}

/// Ranges of neighbouring windows with speech, seconds.
pub fn ranges_of(speech: &[bool]) -> Vec<Range<f64>> {
    let secs = |window: usize| (window * WINDOW) as f64 / f64::from(RATE);
    true_ranges(speech).map(|range| secs(range.start)..secs(range.end)).collect()
}

/// Speech probability of every window of 512 samples of a wav file, read as a stream.
///
/// # Errors
/// Those of `shares`.
pub fn probabilities(path: &Path, model: &mut SpeechModel) -> Result<Vec<f32>> {
    let wav = hound::WavReader::open(path).with_context(|| format!("cannot read {}", path.display()))?;
    let rate = wav.spec().sample_rate;
    ensure!(rate == RATE, "{}: audio at {rate} Hz, expected {RATE} Hz: run the stage extract again", path.display());
    let mut probabilities = Vec::new();
    sound::pieces(path, WINDOW, |window| {
        probabilities.push(model.probability(window)?);
        Ok(())
    })?;
    Ok(probabilities)
}

/// Windows with speech: from a probability of 0.5 until it stays below 0.35 for 0.1 s; those below 0.25 s are dropped.
pub fn is_speech(probabilities: &[f32]) -> Vec<bool> {
    let windows = |secs: f64| (secs * f64::from(RATE) / WINDOW as f64).round() as usize;
    let (hangover, shortest) = (windows(HANGOVER_SECS), windows(MIN_SPEECH_SECS));
    let mut speech = vec![false; probabilities.len()];
    let mut start = 0;
    while start < probabilities.len() {
        if probabilities[start] < START_PROBABILITY {
            start += 1;
            continue;
        }
        // `end` follows the last window above the end threshold before a silence longer than the hangover.
        let mut end = start + 1;
        let mut next = end;
        while next < probabilities.len() && next - end <= hangover {
            if probabilities[next] >= END_PROBABILITY {
                end = next + 1;
            }
            next += 1;
        }
        if end - start >= shortest {
            speech[start..end].fill(true);
        }
        start = end;
    }
    speech
}

/// Share of windows with speech within 2 s of the centre of each frame.
pub fn shares_of(speech: &[bool], fps: FrameRate, n_frames: usize) -> Vec<f32> {
    let mut sums = vec![0_u32];
    for &speech in speech {
        sums.push(sums.last().unwrap_or(&0) + u32::from(speech));
    }
    let window_at = |secs: f64| {
        let at = (secs.max(0.0) * f64::from(RATE) / WINDOW as f64).round() as usize;
        at.min(speech.len())
    };
    let share = |frame: usize| {
        let start = fps.secs(frame);
        let middle = start + 0.5 / fps.per_sec();
        if window_at(start) == speech.len() {
            return f32::NAN;
        }
        let around = window_at(middle - WINDOW_SECS / 2.0)..window_at(middle + WINDOW_SECS / 2.0);
        (sums[around.end] - sums[around.start]) as f32 / around.len().max(1) as f32
    };
    (0..n_frames).map(share).collect()
}
