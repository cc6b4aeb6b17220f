//! Audio fingerprints: 32 bits every 32 ms that identify a recording after cutting, re-encoding and a change of level
//! (Haitsma and Kalker, "A Highly Robust Audio Fingerprinting System", ISMIR 2002). `dataset` finds videos that share
//! sound. A window of 256 ms has 33 bands from 300 to 3000 Hz of equal width in pitch. Bit m of a code is set if the
//! difference between the energies of bands m and m + 1 has grown since the window before. Silence has the code 0.

use super::spectrum::StreamedSpectra;
use realfft::num_complex::Complex;

/// Samples between successive codes, at 16 kHz.
pub const HOP: usize = 512;
/// Codes per second.
pub const PER_SEC: f64 = 16_000.0 / HOP as f64;

const WINDOW: usize = 4096;
const N_BANDS: usize = 33;
const LOWEST_HZ: f64 = 300.0;
const HIGHEST_HZ: f64 = 3000.0;
/// Mean square below which a window is silent: -60 dB of full scale.
const SILENCE: f64 = 1e-6;

/// Computes the codes of a sound at 16 kHz that arrives in chunks of any length.
pub struct Fingerprinter {
    spectra: StreamedSpectra,
    bands: BandDifferences,
    codes: Vec<u32>,
}

/// Computes the code of a window from the energies of its bands and of those of the window before.
struct BandDifferences {
    /// First bin of each band, then the end of the last band.
    edges: [usize; N_BANDS + 1],
    before: [f64; N_BANDS],
}

impl Default for Fingerprinter {
    fn default() -> Self {
        let bin = |band: usize| {
            let hz = LOWEST_HZ * (HIGHEST_HZ / LOWEST_HZ).powf(band as f64 / N_BANDS as f64);
            (hz * WINDOW as f64 / 16_000.0).round() as usize
        };
        let hann = |n: usize| (std::f64::consts::PI * n as f64 / WINDOW as f64).sin().powi(2) as f32;
        Self {
            spectra: StreamedSpectra::new((0..WINDOW).map(hann).collect(), HOP, Vec::new()),
            bands: BandDifferences { edges: std::array::from_fn(bin), before: [0.0; N_BANDS] },
            codes: Vec::new(),
        }
    }
}

impl Fingerprinter {
    /// Processes the next samples, -1..1.
    pub fn push(&mut self, samples: &[f32]) {
        self.spectra.push(samples, |sound, bins| self.codes.push(self.bands.code(sound, bins)));
    }

    /// Returns one code per complete window.
    pub fn finish(self) -> Vec<u32> {
        self.codes
    }
}

impl BandDifferences {
    fn code(&mut self, sound: &[f32], bins: &[Complex<f32>]) -> u32 {
        let silent = sound.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>() < SILENCE * WINDOW as f64;
        let energy = |band: usize| {
            bins[self.edges[band]..self.edges[band + 1]].iter().map(|bin| f64::from(bin.norm_sqr())).sum::<f64>()
        };
        let bands: [f64; N_BANDS] = std::array::from_fn(energy);
        let before = std::mem::replace(&mut self.before, bands);
        let grew = |m: usize| (bands[m] - bands[m + 1]) - (before[m] - before[m + 1]) > 0.0;
        let code = (0..N_BANDS - 1).fold(0, |code, m| code << 1 | u32::from(grew(m)));
        if silent { 0 } else { code.max(1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Sums of six tones that change 20 times a second.
    fn babble(secs: usize, seed: u64) -> Vec<f32> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut tones = [(0.0f32, 0.0f32); 6];
        let sample = |n: usize| {
            if n.is_multiple_of(800) {
                tones = std::array::from_fn(|_| (rng.random_range(300.0..3000.0), rng.random_range(0.0..0.1)));
            }
            let time = n as f32 / 16_000.0;
            tones.iter().map(|(hz, level)| level * (std::f32::consts::TAU * hz * time).sin()).sum::<f32>()
        };
        (0..16_000 * secs).map(sample).collect()
    }

    fn codes(samples: &[f32], chunk: usize) -> Vec<u32> {
        let mut fingerprinter = Fingerprinter::default();
        samples.chunks(chunk).for_each(|chunk| fingerprinter.push(chunk));
        fingerprinter.finish()
    }

    #[test]
    fn codes_are_independent_of_chunk_lengths_and_silence_is_zero() {
        let sound = babble(4, 1);
        assert_eq!(codes(&sound, 64_000), codes(&sound, 777));
        assert_eq!(codes(&sound, 999).len(), (64_000 - WINDOW) / HOP + 1);
        assert!(codes(&vec![0.0; 20_000], 512).iter().all(|code| *code == 0));
    }
}
