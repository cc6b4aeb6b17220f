//! How much of the sound around each frame is speech: probabilities of the speech model, window by window, made into
//! stretches of speech, and their share in the seconds around a frame. Memory: a number a window of 32 ms.

use crate::sound;
use anyhow::{Context, Result, ensure};
use orator_base::types::time::FrameRate;
use orator_onnx::speech::{SpeechModel, WINDOW};
use std::path::Path;

/// Seconds around a frame that are looked at: a sentence with the pauses in it.
const AROUND_SECS: f64 = 4.0;
/// Speech begins at this probability, and ends below the other (Silero's own defaults, as are the next two).
const BEGINS: f32 = 0.5;
const ENDS: f32 = 0.35;
/// Longest silence inside speech, and shortest speech, seconds.
const HANGOVER_SECS: f64 = 0.1;
const SHORTEST_SECS: f64 = 0.25;
/// Samples a second.
const RATE: u32 = orator_base::types::sound::SAMPLE_RATE;

/// Share of speech, 0..1, in the 4 s around each frame of the sound in the file at `path`; NaN for frames without sound.
///
/// # Errors
/// A file that is no 16-bit sound at 16 kHz; a model that fails.
pub fn shares(path: &Path, model: &mut SpeechModel, fps: FrameRate, n_frames: usize) -> Result<Vec<f32>> {
    let probabilities = if path.exists() { probabilities(path, model)? } else { Vec::new() };
    Ok(shares_of(&is_speech(&probabilities), fps, n_frames))
}

/// Probability of speech in every window of 512 samples of a wav file, which is read as a stream.
///
/// # Errors
/// Those of `shares`.
pub fn probabilities(path: &Path, model: &mut SpeechModel) -> Result<Vec<f32>> {
    let wav = hound::WavReader::open(path).with_context(|| format!("cannot read {}", path.display()))?;
    let rate = wav.spec().sample_rate;
    ensure!(rate == RATE, "{}: sound at {rate} Hz, expected {RATE}: run the stage extract again", path.display());
    let mut probabilities = Vec::new();
    sound::pieces(path, WINDOW, |window| {
        probabilities.push(model.probability(window)?);
        Ok(())
    })?;
    Ok(probabilities)
}

/// Which windows are speech: from a probability of 0.5 on until it stays below 0.35 for a tenth of a second; what is
/// shorter than a quarter of a second is none.
fn is_speech(probabilities: &[f32]) -> Vec<bool> {
    let windows = |secs: f64| (secs * f64::from(RATE) / WINDOW as f64).round() as usize;
    let (hangover, shortest) = (windows(HANGOVER_SECS), windows(SHORTEST_SECS));
    let mut speech = vec![false; probabilities.len()];
    let mut start = 0;
    while start < probabilities.len() {
        if probabilities[start] < BEGINS {
            start += 1;
            continue;
        }
        // The last window that is not below the end, before a silence longer than the hangover.
        let mut end = start + 1;
        let mut next = end;
        while next < probabilities.len() && next - end <= hangover {
            if probabilities[next] >= ENDS {
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

/// Share of the windows within 2 s of the middle of each frame that are speech.
fn shares_of(speech: &[bool], fps: FrameRate, n_frames: usize) -> Vec<f32> {
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
        let around = window_at(middle - AROUND_SECS / 2.0)..window_at(middle + AROUND_SECS / 2.0);
        (sums[around.end] - sums[around.start]) as f32 / around.len().max(1) as f32
    };
    (0..n_frames).map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const FPS: FrameRate = FrameRate::new(15, 1);

    /// Probabilities of stretches (probability, windows).
    fn stretches(stretches: &[(f32, usize)]) -> Vec<f32> {
        stretches.iter().flat_map(|(probability, n)| vec![*probability; *n]).collect()
    }

    fn n_speech(of: &[(f32, usize)]) -> usize {
        is_speech(&stretches(of)).into_iter().filter(|speech| *speech).count()
    }

    #[test]
    fn speech_has_a_beginning_an_end_and_a_length() {
        assert_eq!(n_speech(&[(0.1, 20), (0.9, 20), (0.1, 20)]), 20);
        // between the two thresholds speech goes on, but does not begin
        assert_eq!(n_speech(&[(0.4, 20), (0.9, 10), (0.4, 20), (0.1, 20)]), 30);
        // a tenth of a second of silence is inside, longer silence is not
        assert_eq!(n_speech(&[(0.9, 10), (0.0, 3), (0.9, 10)]), 23);
        assert_eq!(n_speech(&[(0.9, 10), (0.0, 4), (0.9, 10)]), 20);
        // claps: each too short to be speech
        assert_eq!(n_speech(&[(0.9, 4), (0.0, 10), (0.9, 6), (0.0, 10), (0.9, 3)]), 0);
        assert_eq!(is_speech(&[]), [false; 0]);
    }

    #[test]
    fn a_share_is_that_of_the_seconds_around() {
        // 10 s of speech, 10 s of something else; 31.25 windows a second
        let speech = is_speech(&stretches(&[(0.9, 312), (0.0, 313)]));
        let shares = shares_of(&speech, FPS, 310);
        assert_eq!((shares[0], shares[60], shares[220]), (1.0, 1.0, 0.0));
        assert!((shares[150] - 0.5).abs() < 0.02 && shares[130] > 0.8 && shares[170] < 0.2, "{}", shares[150]);
        // the sound ends after 20 s
        assert!(!shares[299].is_nan() && shares[301].is_nan());
        assert!(shares_of(&[], FPS, 3).iter().all(|share| share.is_nan()));
        // pauses of a second between sentences leave more than half
        let sentences = stretches(&[(0.9, 60), (0.0, 31)]).repeat(8);
        let shares = shares_of(&is_speech(&sentences), FPS, 340);
        assert!(shares[..320].iter().all(|share| *share >= 0.5), "{shares:?}");
    }
}
