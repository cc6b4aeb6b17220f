//! Mouth openness estimated from the voice. Open vowels have most energy between 600 and 5000 Hz; closed lips leave
//! the murmur below (the first formant falls as the jaw closes: Stevens, Acoustic Phonetics, 1998, section 3.2), and
//! the fricatives above are spoken with the teeth together. The contrast of the three in dB is independent of gain: a
//! quieter voice does not appear more closed.

use super::spectrum::{StreamedSpectra, hann};
use crate::types::sound::SAMPLE_RATE;
use std::f64::consts::TAU;
use std::ops::Range;

/// Window length and hop in samples: 32 ms, 10 ms.
const WINDOW: usize = 512;
const HOP: usize = 160;
/// Edges of the bands in Hz, and the weight of each band's level in dB: murmur, open voice, hiss.
const EDGES_HZ: [f64; 8] = [100.0, 300.0, 600.0, 1000.0, 1800.0, 3000.0, 5000.0, 7800.0];
const WEIGHTS: [f32; N_BANDS] = [-0.5, -0.5, 0.5, 0.5, 0.5, 0.5, -0.5];
const N_BANDS: usize = 7;
/// Level below the loud parts of a band at which it counts as silent, dB; a tenth of the windows exceed the loud level.
const SILENCE_DB: f32 = -30.0;
const LOUD_QUANTILE: f64 = 0.9;
/// Number of steps on either side over which the contrast is smoothed.
const SMOOTH: usize = 5;

/// Measures the openness of a voice in a sound that arrives in chunks. Memory: 28 bytes per 10 ms of sound.
pub struct OpennessMeter {
    spectra: StreamedSpectra,
    bins: [Range<usize>; N_BANDS],
    energies: Vec<[f32; N_BANDS]>,
}

/// Openness of the mouth every 10 ms, dB.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Openness(Vec<f32>);

impl Default for OpennessMeter {
    fn default() -> Self {
        let bin = |hz: f64| (hz / f64::from(SAMPLE_RATE) * WINDOW as f64).ceil() as usize;
        Self {
            spectra: StreamedSpectra::new(hann(WINDOW), HOP, Vec::new()),
            bins: std::array::from_fn(|band| bin(EDGES_HZ[band])..bin(EDGES_HZ[band + 1])),
            energies: Vec::new(),
        }
    }
}

impl OpennessMeter {
    /// Processes the next samples, mono at 16 kHz, -1..1.
    pub fn push(&mut self, samples: &[f32]) {
        self.spectra.push(samples, |_, spectrum| {
            let energy = |bins: &Range<usize>| spectrum[bins.clone()].iter().map(|bin| bin.norm_sqr()).sum();
            self.energies.push(std::array::from_fn(|band| energy(&self.bins[band])));
        });
    }

    /// Returns the openness over the complete sound.
    pub fn finish(self) -> Openness {
        let loud: [f32; N_BANDS] = std::array::from_fn(|band| {
            let mut energies: Vec<f32> = self.energies.iter().map(|energies| energies[band]).collect();
            let rank = (LOUD_QUANTILE * energies.len().saturating_sub(1) as f64) as usize;
            let loud = if energies.is_empty() { 0.0 } else { *energies.select_nth_unstable_by(rank, f32::total_cmp).1 };
            loud.max(1e-9)
        });
        let floor = 10.0_f32.powf(SILENCE_DB / 10.0);
        let contrast = |energies: &[f32; N_BANDS]| -> f32 {
            (0..N_BANDS).map(|band| WEIGHTS[band] * 10.0 * (energies[band] / loud[band] + floor).log10()).sum()
        };
        Openness(smoothed(&self.energies.iter().map(contrast).collect::<Vec<_>>()))
    }
}

impl Openness {
    /// Returns the openness at a time in seconds, interpolated linearly; NaN outside the sound.
    pub fn at(&self, secs: f64) -> f32 {
        let position = (secs * f64::from(SAMPLE_RATE) - WINDOW as f64 / 2.0) / HOP as f64;
        if !(position >= 0.0 && position <= self.0.len().saturating_sub(1) as f64) || self.0.is_empty() {
            return f32::NAN;
        }
        let (before, part) = (position as usize, position.fract() as f32);
        let after = self.0.get(before + 1).unwrap_or(&self.0[before]);
        self.0[before] + part * (after - self.0[before])
    }
}

/// Smooths with a raised cosine, which is truncated and renormalised at the ends.
fn smoothed(values: &[f32]) -> Vec<f32> {
    let weight = |away: usize| (0.5 + 0.5 * (TAU / 2.0 * away as f64 / (SMOOTH + 1) as f64).cos()) as f32;
    let weights: [f32; SMOOTH + 1] = std::array::from_fn(weight);
    let mean = |at: usize| {
        let around = at.saturating_sub(SMOOTH)..values.len().min(at + SMOOTH + 1);
        let (sum, all) = around.fold((0.0, 0.0), |(sum, all), k| {
            let weight = weights[at.abs_diff(k)];
            (sum + weight * values[k], all + weight)
        });
        sum / all
    };
    (0..values.len()).map(mean).collect()
}
