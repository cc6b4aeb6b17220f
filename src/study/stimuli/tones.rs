//! Sound of the sound check: tones that a participant counts.

use orator_base::types::sound::Sound;
use std::f64::consts::{PI, TAU};

/// Frequency in Hz, which small loudspeakers play too, and amplitude.
const HZ: f64 = 700.0;
const AMPLITUDE: f64 = 0.1;
/// Seconds of the longest tone, and over which a tone comes and goes.
const LONGEST: f64 = 0.4;
const FADE_SECS: f64 = 0.02;

/// `n` tones with as much silence around each, over `length` samples.
pub fn tones(n: usize, rate: u32, length: usize) -> Sound {
    let rate_hz = f64::from(rate.max(1));
    let apart = length as f64 / rate_hz / (n + 1) as f64;
    let secs = (apart / 2.0).min(LONGEST);
    let fade = FADE_SECS.min(secs / 4.0);
    let sample = |at: usize| {
        let time = at as f64 / rate_hz;
        let nearest = (time / apart).round().clamp(1.0, n.max(1) as f64);
        let left = secs / 2.0 - (time - nearest * apart).abs();
        let gain = if n == 0 { 0.0 } else { (left / fade).clamp(0.0, 1.0) };
        (AMPLITUDE * (0.5 - 0.5 * (PI * gain).cos()) * (TAU * HZ * time).sin()) as f32
    };
    Sound { rate, samples: (0..length).map(sample).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn so_many_tones_are_heard_in_films_of_any_length() {
        for secs in [1, 12] {
            let sound = tones(3, 16_000, 16_000 * secs);
            // Loudness of steps of 20 ms.
            let loud: Vec<bool> = sound.samples.chunks(320).map(|step| step.iter().any(|v| v.abs() > 0.05)).collect();
            let n_begun = loud.windows(2).filter(|pair| !pair[0] && pair[1]).count();
            assert_eq!((n_begun, loud[0], loud[loud.len() - 1]), (3, false, false));
        }
        assert!(tones(0, 16_000, 100).samples.iter().all(|v| *v == 0.0));
        assert!(tones(3, 16_000, 0).samples.is_empty());
    }
}
