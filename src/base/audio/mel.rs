//! Log-mel spectrograms as computed by speech2gesture (TensorFlow's `stft` and `linear_to_mel_weight_matrix`):
//! magnitudes, 64 triangular bands on the HTK mel scale, natural logarithm. No padding and no normalisation.

use super::spectrum::{Spectrum, hann};
use crate::types::sound::SAMPLE_RATE;
use ndarray::Array2;
use std::ops::RangeInclusive;
use std::sync::LazyLock;

/// Window length, hop and length of the Fourier transform in samples: 25 ms, 10 ms, 32 ms.
pub const WINDOW: usize = 400;
pub const HOP: usize = 160;
pub const FFT: usize = 512;
/// Number of mel bands, and the lowest and highest frequency that they cover in Hz.
pub const N_MELS: usize = 64;
pub const LOWEST_HZ: f64 = 125.0;
pub const HIGHEST_HZ: f64 = 7500.0;
/// Offset added before the logarithm.
pub const FLOOR: f32 = 1e-6;

/// Number of spectrogram frames of `n_samples` samples; only complete windows count.
pub const fn n_frames(n_samples: usize) -> usize {
    if n_samples < WINDOW { 0 } else { (n_samples - WINDOW) / HOP + 1 }
}

/// Number of samples that give exactly `n_frames` spectrogram frames.
pub const fn n_samples(n_frames: usize) -> usize {
    if n_frames == 0 { 0 } else { (n_frames - 1) * HOP + WINDOW }
}

/// Computes ln(mel + 1e-6) of mono sound at 16 kHz, samples in -1..1: [`n_frames`, 64]. Frame k starts at k * 10 ms.
pub fn log_mel(samples: &[f32]) -> Array2<f32> {
    let mut spectrum = Spectrum::new(hann(WINDOW), FFT);
    let mut magnitudes = vec![0.0f32; FFT / 2 + 1];
    let mut mels = Array2::zeros((n_frames(samples.len()), N_MELS));
    for (k, mut row) in mels.outer_iter_mut().enumerate() {
        let bins = spectrum.of(&samples[k * HOP..][..WINDOW]);
        magnitudes.iter_mut().zip(bins).for_each(|(magnitude, bin)| *magnitude = bin.norm());
        for (mel, band) in row.iter_mut().zip(BANDS.iter()) {
            let sum: f32 = band.weights.iter().zip(&magnitudes[band.first..]).map(|(w, bin)| w * bin).sum();
            *mel = (sum + FLOOR).ln();
        }
    }
    mels
}

/// Lower corner frequency of a band's triangle in Hz.
pub fn lowest_hz(band: usize) -> f64 {
    700.0 * ((corner(band) / 1127.0).exp() - 1.0)
}

/// Corner `i` of the triangles in mel, equally spaced.
fn corner(i: usize) -> f64 {
    let (low, high) = (mel_of(LOWEST_HZ), mel_of(HIGHEST_HZ));
    low + (high - low) * i as f64 / (N_MELS + 1) as f64
}

fn mel_of(hz: f64) -> f64 {
    1127.0 * (1.0 + hz / 700.0).ln()
}

/// Weights of the bins of every band, from the lowest band up.
pub fn all_bands() -> &'static [Band] {
    &BANDS
}

static BANDS: LazyLock<Vec<Band>> = LazyLock::new(bands);

/// Bins of one band, with their weights.
pub struct Band {
    pub first: usize,
    pub weights: Vec<f32>,
}

impl Band {
    /// Creates a band from those of `bins` whose `weight` is above 0.
    pub fn new(bins: RangeInclusive<usize>, weight: impl Fn(usize) -> f64) -> Self {
        let inside: Vec<(usize, f64)> =
            bins.map(|bin| (bin, weight(bin))).filter(|(_, weight)| *weight > 0.0).collect();
        let first = inside.first().map_or(0, |(bin, _)| *bin);
        Self { first, weights: inside.into_iter().map(|(_, weight)| weight as f32).collect() }
    }
}

/// Triangles with corners equally spaced in mel; the zero bin belongs to no band.
fn bands() -> Vec<Band> {
    let weight = |band: usize, bin: usize| {
        let at = mel_of(bin as f64 * f64::from(SAMPLE_RATE) / FFT as f64);
        let (left, middle, right) = (corner(band), corner(band + 1), corner(band + 2));
        ((at - left) / (middle - left)).min((right - at) / (right - middle)).max(0.0)
    };
    (0..N_MELS).map(|band| Band::new(1..=FFT / 2, |bin| weight(band, bin))).collect()
}
