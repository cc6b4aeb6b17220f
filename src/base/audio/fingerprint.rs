//! What a piece of sound is like, in 32 bits every 32 ms, so that the same recording is known again after cutting,
//! re-encoding and a change of level (Haitsma and Kalker, "A Highly Robust Audio Fingerprinting System", ISMIR 2002).
//! Which videos share sound is asked in `dataset`.
//!
//! A window of 256 ms is divided into 33 bands from 300 to 3000 Hz, equally wide in pitch. Bit m of a code says whether
//! the difference of the energies of bands m and m + 1 grew since the window before. Silence has the code 0.

use super::spectrum::StreamedSpectra;
use realfft::num_complex::Complex;

/// Samples between two codes, at 16 kHz.
pub const HOP: usize = 512;
/// Codes a second.
pub const PER_SEC: f64 = 16_000.0 / HOP as f64;

const WINDOW: usize = 4096;
const N_BANDS: usize = 33;
const LOWEST_HZ: f64 = 300.0;
const HIGHEST_HZ: f64 = 3000.0;
/// Mean square below which a window is silence: -60 dB of full scale.
const SILENCE: f64 = 1e-6;

/// Makes the codes of a sound at 16 kHz that comes in pieces of any length.
pub struct Fingerprinter {
    spectra: StreamedSpectra,
    bands: BandDifferences,
    codes: Vec<u32>,
}

/// Makes the code of a window from its bands and those of the window before.
struct BandDifferences {
    /// First bin of each band, and the end of the last.
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
    /// Takes the next samples, -1..1.
    pub fn push(&mut self, samples: &[f32]) {
        self.spectra.push(samples, |sound, bins| self.codes.push(self.bands.code(sound, bins)));
    }

    /// A code for every whole window.
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

    /// Noise whose colour changes 20 times a second.
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

    fn codes(samples: &[f32], piece: usize) -> Vec<u32> {
        let mut fingerprinter = Fingerprinter::default();
        samples.chunks(piece).for_each(|piece| fingerprinter.push(piece));
        fingerprinter.finish()
    }

    fn wrong_bits(a: &[u32], b: &[u32]) -> f64 {
        let wrong: u32 = a.iter().zip(b).map(|(a, b)| (a ^ b).count_ones()).sum();
        f64::from(wrong) / (32 * a.len().min(b.len())) as f64
    }

    #[test]
    fn pieces_do_not_matter_and_silence_is_zero() {
        let sound = babble(4, 1);
        assert_eq!(codes(&sound, 64_000), codes(&sound, 777));
        assert_eq!(codes(&sound, 999).len(), (64_000 - WINDOW) / HOP + 1);
        assert!(codes(&vec![0.0; 20_000], 512).iter().all(|code| *code == 0));
    }

    #[test]
    fn the_same_sound_is_near_and_another_far() {
        let sound = babble(10, 1);
        let whole = codes(&sound, 4096);
        // half a hop off (the worst), quieter, with noise 20 dB below
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let level = (sound.iter().map(|v| v * v).sum::<f32>() / sound.len() as f32).sqrt();
        let copy: Vec<f32> = sound[256..].iter().map(|v| 0.3 * (v + level * rng.random_range(-0.17..0.17))).collect();
        let near = wrong_bits(&whole, &codes(&copy, 4096));
        let far = wrong_bits(&whole, &codes(&babble(10, 2), 4096));
        assert!(near < 0.25 && (far - 0.5).abs() < 0.03, "{near} {far}");
    }
}
