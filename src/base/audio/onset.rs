//! Audio onsets as detected by librosa 0.11 with `onset_detect(y, sr=16000, hop_length=512, units="time")`, on which
//! the field's beat metrics are based: spectral flux of 128 mel bands in decibels (Boeck and Widmer 2013), then peaks
//! above their surroundings. Decibels are clipped at 80 below the maximum of the complete sound, so a sound needs two
//! passes: `Loudest`, then `Onsets`. Both process it in chunks and store only the strength per hop, 4 bytes per 32 ms.

use super::mel::Band;
use super::spectrum::{StreamedSpectra, hann};
use crate::types::sound::SAMPLE_RATE;

/// Hop between frames, and window length, in samples.
pub const HOP: usize = 512;
const WINDOW: usize = 2048;
const N_MELS: usize = 128;
/// Minimum power; anything below is silence.
const MIN_POWER: f32 = 1e-10;
/// Dynamic range below the maximum, in decibels.
const RANGE_DB: f32 = 80.0;
/// Frames without an onset strength at the start: the lag of 1, and half a window.
const N_BEFORE: usize = 1 + WINDOW / (2 * HOP);
/// Minimum height of a peak above the mean of the frames from 3 before to 3 after it, for strengths scaled to 0..1.
const DELTA: f64 = 0.07;
const AROUND: usize = 3;

/// Onset times in seconds of mono sound at 16 kHz, samples in -1..1 (non-finite ones count as 0). Empty if constant.
pub fn onsets(samples: &[f32]) -> Vec<f64> {
    let mut loudest = Loudest::default();
    loudest.push(samples);
    let mut onsets = Onsets::new(loudest.finish());
    onsets.push(samples);
    onsets.finish()
}

/// First pass: maximum level of any band in decibels.
pub struct Loudest {
    spectra: Spectra,
    max: f32,
}

impl Default for Loudest {
    fn default() -> Self {
        Self { spectra: Spectra::new(), max: f32::NEG_INFINITY }
    }
}

impl Loudest {
    pub fn push(&mut self, samples: &[f32]) {
        let max = &mut self.max;
        self.spectra.push(samples, |bands| *max = bands.iter().fold(*max, |max, db| max.max(*db)));
    }

    /// Returns the maximum level in decibels.
    pub fn finish(mut self) -> f32 {
        self.push(&[0.0; WINDOW / 2]);
        self.max
    }
}

/// Second pass: onset detection.
pub struct Onsets {
    spectra: Spectra,
    flux: Flux,
}

/// Increase of the level from each frame to the next.
struct Flux {
    floor_db: f32,
    previous: Option<[f32; N_MELS]>,
    strengths: Vec<f32>,
}

impl Onsets {
    /// Starts the second pass with the result of `Loudest`.
    pub fn new(loudest_db: f32) -> Self {
        let flux = Flux { floor_db: loudest_db - RANGE_DB, previous: None, strengths: Vec::new() };
        Self { spectra: Spectra::new(), flux }
    }

    pub fn push(&mut self, samples: &[f32]) {
        let flux = &mut self.flux;
        self.spectra.push(samples, |bands| flux.push(bands));
    }

    /// Returns the onset strength of every hop of `HOP` samples: the mean over bands of the rise in decibels since the
    /// hop before; 0 for the first 3 hops.
    pub fn strengths(mut self) -> Vec<f32> {
        self.push(&[0.0; WINDOW / 2]);
        let n = self.flux.strengths.len();
        let mut strengths = vec![0.0; N_BEFORE];
        // The first frame has no predecessor.
        strengths.extend(self.flux.strengths.into_iter().skip(1));
        strengths.truncate(n);
        strengths
    }

    /// Returns the onset times in seconds.
    pub fn finish(self) -> Vec<f64> {
        let secs = |frame: usize| (frame * HOP) as f64 / f64::from(SAMPLE_RATE);
        peaks(&self.strengths()).into_iter().map(secs).collect()
    }
}

impl Flux {
    fn push(&mut self, bands: &[f32; N_MELS]) {
        let bands = bands.map(|db| db.max(self.floor_db));
        let rise = |previous: [f32; N_MELS]| {
            bands.iter().zip(&previous).map(|(now, before)| (now - before).max(0.0)).sum::<f32>() / N_MELS as f32
        };
        self.strengths.push(self.previous.map_or(0.0, rise));
        self.previous = Some(bands);
    }
}

/// Returns the frames whose strength, scaled to 0..1, exceeds the mean around them by at least `DELTA`. (At this rate
/// and hop librosa's other conditions, local maximum and waiting time, span less than a frame.)
fn peaks(strengths: &[f32]) -> Vec<usize> {
    let min = strengths.iter().copied().fold(f32::INFINITY, f32::min);
    let range = strengths.iter().copied().fold(f32::NEG_INFINITY, f32::max) - min;
    // No frames, or constant strength.
    if range.is_nan() || range <= 0.0 {
        return Vec::new();
    }
    let scaled: Vec<f32> = strengths.iter().map(|v| (v - min) / (range + f32::MIN_POSITIVE)).collect();
    let is_peak = |i: &usize| {
        let around = &scaled[i.saturating_sub(AROUND)..(i + AROUND + 1).min(scaled.len())];
        f64::from(scaled[*i]) >= f64::from(around.iter().sum::<f32>()) / around.len() as f64 + DELTA
    };
    (0..scaled.len()).filter(is_peak).collect()
}

/// Converts sound in chunks to mel bands in decibels: a frame every `HOP` samples, whose window is centred on the
/// frame's time and padded with zeros at the ends.
struct Spectra {
    windows: StreamedSpectra,
    bands: Vec<Band>,
}

impl Spectra {
    fn new() -> Self {
        Self { windows: StreamedSpectra::new(hann(WINDOW), HOP, vec![0.0; WINDOW / 2]), bands: bands() }
    }

    fn push(&mut self, samples: &[f32], mut each: impl FnMut(&[f32; N_MELS])) {
        for chunk in samples.chunks(16 * WINDOW) {
            let chunk: Vec<f32> = chunk.iter().map(|v| if v.is_finite() { *v } else { 0.0 }).collect();
            self.windows.push(&chunk, |_, spectrum| {
                let mut decibels = [0.0; N_MELS];
                for (db, band) in decibels.iter_mut().zip(&self.bands) {
                    let bins = band.weights.iter().zip(spectrum.get(band.first..).unwrap_or_default());
                    let power: f32 = bins.map(|(weight, bin)| weight * bin.norm_sqr()).sum();
                    *db = 10.0 * power.max(MIN_POWER).log10();
                }
                each(&decibels);
            });
        }
    }
}

/// Triangles of equal area with corners equally spaced on Slaney's mel scale from 0 to 8000 Hz: linear below 1000 Hz,
/// logarithmic above (Slaney, Auditory Toolbox, 1998).
fn bands() -> Vec<Band> {
    const LINEAR: f64 = 200.0 / 3.0;
    const BREAK_HZ: f64 = 1000.0;
    let step = 6.4f64.ln() / 27.0;
    let nyquist = f64::from(SAMPLE_RATE) / 2.0;
    let max_mel = BREAK_HZ / LINEAR + (nyquist / BREAK_HZ).ln() / step;
    let hz = |mel: f64| match mel * LINEAR {
        hz if hz < BREAK_HZ => hz,
        _ => BREAK_HZ * (step * (mel - BREAK_HZ / LINEAR)).exp(),
    };
    let corner = |i: usize| hz(max_mel * i as f64 / (N_MELS + 1) as f64);
    let band = |i: usize| {
        let (left, middle, right) = (corner(i), corner(i + 1), corner(i + 2));
        let weight = |bin: usize| {
            let at = bin as f64 * f64::from(SAMPLE_RATE) / WINDOW as f64;
            let height = ((at - left) / (middle - left)).min((right - at) / (right - middle));
            height.max(0.0) * 2.0 / (right - left)
        };
        Band::new(0..=WINDOW / 2, weight)
    };
    (0..N_MELS).map(band).collect()
}
