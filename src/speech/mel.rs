//! Log-mel spectrograms as computed by OpenAI's Whisper: power spectra of 25 ms windows every 10 ms, 80 bands on
//! Slaney's mel scale (librosa's default), decimal logarithm, limited to 8 below the maximum.

use ndarray::Array2;
use orator_base::audio::mel::{Band, HOP, WINDOW};
use orator_base::audio::spectrum::{Spectrum, hann};
use std::sync::LazyLock;

/// Number of mel bands.
pub const N_MELS: usize = 80;
/// Number of samples of a window of the recogniser: 30 s at 16 kHz.
pub const WINDOW_SAMPLES: usize = 480_000;
/// Number of frames of a window.
const N_FRAMES: usize = WINDOW_SAMPLES / HOP;

/// Computes the spectrogram [80, 3000] of mono sound at 16 kHz, samples in -1..1, that is padded with zeros or cut to
/// 480,000 samples. Frame k is centred at k * 10 ms; the sound is mirrored at both ends.
pub fn log_mel(samples: &[f32]) -> Array2<f32> {
    let half = (WINDOW / 2) as isize;
    let last = WINDOW_SAMPLES as isize - 1;
    let sample = |at: isize| samples.get((last - (last - at.abs()).abs()) as usize).copied().unwrap_or_default();
    let mut spectrum = Spectrum::new(hann(WINDOW), WINDOW);
    let (mut window, mut powers) = ([0.0f32; WINDOW], [0.0f32; WINDOW / 2 + 1]);
    let mut mels = Array2::zeros((N_MELS, N_FRAMES));
    for (frame, mut column) in mels.columns_mut().into_iter().enumerate() {
        let first = (frame * HOP) as isize - half;
        window.iter_mut().zip(first..).for_each(|(value, at)| *value = sample(at));
        powers.iter_mut().zip(spectrum.of(&window)).for_each(|(power, bin)| *power = bin.norm_sqr());
        for (mel, band) in column.iter_mut().zip(BANDS.iter()) {
            let sum: f32 = band.weights.iter().zip(&powers[band.first..]).map(|(w, power)| w * power).sum();
            *mel = sum.max(1e-10).log10();
        }
    }
    let max = mels.fold(f32::MIN, |max, value| max.max(*value));
    mels.mapv_inplace(|value| (value.max(max - 8.0) + 4.0) / 4.0);
    mels
}

static BANDS: LazyLock<Vec<Band>> = LazyLock::new(bands);

/// Triangles of equal area between corners that are equally spaced in mel from 0 to 8 kHz.
fn bands() -> Vec<Band> {
    let corner = |i: usize| hz_of(mel_of(8000.0) * i as f64 / (N_MELS + 1) as f64);
    let band = |i: usize| {
        let [left, middle, right] = [corner(i), corner(i + 1), corner(i + 2)];
        Band::new(0..=WINDOW / 2, |bin| {
            let at = bin as f64 * 16_000.0 / WINDOW as f64;
            let height = ((at - left) / (middle - left)).min((right - at) / (right - middle)).max(0.0);
            height * 2.0 / (right - left)
        })
    };
    (0..N_MELS).map(band).collect()
}

/// Slaney's scale: linear below 1 kHz with 66.7 Hz per mel, logarithmic above with 27 mel per factor 6.4.
fn mel_of(hz: f64) -> f64 {
    if hz < 1000.0 { hz * 3.0 / 200.0 } else { 15.0 + (hz / 1000.0).ln() * 27.0 / 6.4f64.ln() }
}

fn hz_of(mel: f64) -> f64 {
    if mel < 15.0 { mel * 200.0 / 3.0 } else { 1000.0 * ((mel - 15.0) * 6.4f64.ln() / 27.0).exp() }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Contents of `whisper_golden.json`.
    #[derive(serde::Deserialize)]
    pub(crate) struct Golden {
        bands: Vec<(usize, Vec<f32>)>,
        mel: Vec<(usize, Vec<f32>)>,
        pub(crate) small: NetworkGolden,
    }

    #[derive(serde::Deserialize)]
    pub(crate) struct NetworkGolden {
        pub(crate) tokens: Vec<u32>,
        pub(crate) encoded: Vec<f32>,
        pub(crate) logits: Vec<f32>,
        pub(crate) scores: Vec<f32>,
    }

    pub(crate) fn golden() -> anyhow::Result<Golden> {
        Ok(serde_json::from_str(include_str!("../../fixtures/reference/whisper_golden.json"))?)
    }

    /// Sound of `fixtures/reference/whisper_reference.py`: a rising tone, a steady tone, and a hash as noise.
    pub(crate) fn signal(n: usize) -> Vec<f32> {
        let tau = std::f64::consts::TAU;
        let value = |i: usize| {
            let t = i as f64 / 16_000.0;
            let noise = ((i * 7919) % 1009) as f64 / 1009.0 - 0.5;
            0.4 * (tau * (200.0 + 700.0 * t) * t).sin() + 0.2 * (tau * 440.0 * t).sin() + 0.05 * noise
        };
        (0..n).map(|i| value(i) as f32).collect()
    }

    #[test]
    fn bands_and_spectrogram_equal_those_of_openai() -> anyhow::Result<()> {
        let golden = golden()?;
        for (i, ((first, weights), band)) in golden.bands.iter().zip(BANDS.iter()).enumerate() {
            assert_eq!((band.first, band.weights.len()), (*first, weights.len()), "band {i}");
            for (found, expected) in band.weights.iter().zip(weights) {
                assert!((found - expected).abs() < 1e-8, "band {i}: {found}, expected {expected}");
            }
        }
        let mels = log_mel(&signal(67_267));
        assert_eq!((mels.dim(), golden.bands.len()), ((80, 3000), 80));
        for (frame, expected) in golden.mel {
            let worst = mels.column(frame).iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst < 1e-4, "frame {frame}: {worst}");
        }
        Ok(())
    }

    #[test]
    fn sounds_of_any_length_have_3000_frames() {
        for n in [0, 1, 399, 480_000, 500_000] {
            let mels = log_mel(&vec![0.5; n]);
            assert!(mels.dim() == (80, 3000) && mels.iter().all(|v| v.is_finite()), "{n} samples");
        }
        assert_eq!(log_mel(&signal(480_160)), log_mel(&signal(480_000)));
    }
}
