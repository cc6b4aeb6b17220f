//! When something begins in a sound: onsets as librosa 0.11 finds them with `onset_detect(y, sr=16000, hop_length=512,
//! units="time")`, which the beat metrics of the field are made with. Spectral flux of 128 mel bands in decibels (Boeck and
//! Widmer 2013), then peaks that stand out from their surroundings.
//!
//! Decibels are cut 80 below the loudest of the whole sound, so a sound is heard twice: `Loudest`, then `Onsets`. Both
//! take it in pieces; only the strength of each hop is kept, 4 bytes every 32 ms.

use super::mel::Band;
use super::spectrum::{StreamedSpectra, hann};
use crate::types::sound::SAMPLE_RATE;

/// Samples between two frames, and of a window.
pub const HOP: usize = 512;
const WINDOW: usize = 2048;
const N_MELS: usize = 128;
/// Power below this is silence.
const LEAST_POWER: f32 = 1e-10;
/// Decibels below the loudest that count.
const RANGE_DB: f32 = 80.0;
/// Frames without a strength at the start: the lag of 1, and half a window.
const N_BEFORE: usize = 1 + WINDOW / (2 * HOP);
/// A peak stands this far above the mean of the frames from 3 before to 3 after it, of strengths scaled to 0..1.
const DELTA: f64 = 0.07;
const AROUND: usize = 3;

/// Onset times in seconds of mono sound at 16 kHz, samples in -1..1 (one that is not finite counts as 0). Empty where nothing
/// changes.
pub fn onsets(samples: &[f32]) -> Vec<f64> {
    let mut loudest = Loudest::default();
    loudest.push(samples);
    let mut onsets = Onsets::new(loudest.finish());
    onsets.push(samples);
    onsets.finish()
}

/// First hearing: how loud the loudest band ever is, decibels.
pub struct Loudest {
    spectra: Spectra,
    most: f32,
}

impl Default for Loudest {
    fn default() -> Self {
        Self { spectra: Spectra::new(), most: f32::NEG_INFINITY }
    }
}

impl Loudest {
    /// The next samples.
    pub fn push(&mut self, samples: &[f32]) {
        let most = &mut self.most;
        self.spectra.push(samples, |bands| *most = bands.iter().fold(*most, |most, db| most.max(*db)));
    }

    /// Decibels of the loudest band.
    pub fn finish(mut self) -> f32 {
        self.push(&[0.0; WINDOW / 2]);
        self.most
    }
}

/// Second hearing: the onsets.
pub struct Onsets {
    spectra: Spectra,
    flux: Flux,
}

/// How much louder each frame is than the one before.
struct Flux {
    floor_db: f32,
    previous: Option<[f32; N_MELS]>,
    strengths: Vec<f32>,
}

impl Onsets {
    /// With what `Loudest` found.
    pub fn new(loudest_db: f32) -> Self {
        let flux = Flux { floor_db: loudest_db - RANGE_DB, previous: None, strengths: Vec::new() };
        Self { spectra: Spectra::new(), flux }
    }

    /// The next samples.
    pub fn push(&mut self, samples: &[f32]) {
        let flux = &mut self.flux;
        self.spectra.push(samples, |bands| flux.push(bands));
    }

    /// Onset strength of every hop: mean over bands of the rise in decibels since the hop before, `HOP` samples apart, the
    /// first 3 hops 0.
    pub fn strengths(mut self) -> Vec<f32> {
        self.push(&[0.0; WINDOW / 2]);
        let n = self.flux.strengths.len();
        let mut strengths = vec![0.0; N_BEFORE];
        // the first frame has none before it
        strengths.extend(self.flux.strengths.into_iter().skip(1));
        strengths.truncate(n);
        strengths
    }

    /// Onset times, seconds.
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

/// Frames whose strength, scaled to 0..1, is `DELTA` above the mean around it. (At this rate and hop librosa's other rules,
/// local maximum and waiting time, span less than a frame.)
fn peaks(strengths: &[f32]) -> Vec<usize> {
    let least = strengths.iter().copied().fold(f32::INFINITY, f32::min);
    let most = strengths.iter().copied().fold(f32::NEG_INFINITY, f32::max) - least;
    // nothing at all, or nothing that changes
    if most.is_nan() || most <= 0.0 {
        return Vec::new();
    }
    let scaled: Vec<f32> = strengths.iter().map(|v| (v - least) / (most + f32::MIN_POSITIVE)).collect();
    let stands_out = |i: &usize| {
        let around = &scaled[i.saturating_sub(AROUND)..(i + AROUND + 1).min(scaled.len())];
        f64::from(scaled[*i]) >= f64::from(around.iter().sum::<f32>()) / around.len() as f64 + DELTA
    };
    (0..scaled.len()).filter(stands_out).collect()
}

/// Sound in pieces to mel bands in decibels, a frame every `HOP` samples, its window centred on the frame's time and filled
/// up with zeros at the ends.
struct Spectra {
    windows: StreamedSpectra,
    bands: Vec<Band>,
}

impl Spectra {
    fn new() -> Self {
        Self { windows: StreamedSpectra::new(hann(WINDOW), HOP, vec![0.0; WINDOW / 2]), bands: bands() }
    }

    fn push(&mut self, samples: &[f32], mut each: impl FnMut(&[f32; N_MELS])) {
        for piece in samples.chunks(16 * WINDOW) {
            let piece: Vec<f32> = piece.iter().map(|v| if v.is_finite() { *v } else { 0.0 }).collect();
            self.windows.push(&piece, |_, spectrum| {
                let mut decibels = [0.0; N_MELS];
                for (db, band) in decibels.iter_mut().zip(&self.bands) {
                    let bins = band.weights.iter().zip(spectrum.get(band.first..).unwrap_or_default());
                    let power: f32 = bins.map(|(weight, bin)| weight * bin.norm_sqr()).sum();
                    *db = 10.0 * power.max(LEAST_POWER).log10();
                }
                each(&decibels);
            });
        }
    }
}

/// Triangles of equal area with corners equally spaced on Slaney's mel scale, 0 to 8000 Hz: linear below 1000 Hz,
/// logarithmic above (Slaney, Auditory Toolbox, 1998).
fn bands() -> Vec<Band> {
    const LINEAR: f64 = 200.0 / 3.0;
    const BREAK_HZ: f64 = 1000.0;
    let step = 6.4f64.ln() / 27.0;
    let nyquist = f64::from(SAMPLE_RATE) / 2.0;
    let most = BREAK_HZ / LINEAR + (nyquist / BREAK_HZ).ln() / step;
    let hz = |mel: f64| match mel * LINEAR {
        hz if hz < BREAK_HZ => hz,
        _ => BREAK_HZ * (step * (mel - BREAK_HZ / LINEAR)).exp(),
    };
    let corner = |i: usize| hz(most * i as f64 / (N_MELS + 1) as f64);
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Signal of the reference script: bursts of falling tones, 6 s.
    pub(super) fn bursts() -> Vec<f32> {
        let sample = |i: usize| {
            let t = i as f64 / f64::from(SAMPLE_RATE);
            let burst = |k: usize| {
                let since = t - 0.37 * k as f64 - 0.05 * (k % 3) as f64;
                let hz = 180.0 + 70.0 * (k * k % 11) as f64;
                let tone =
                    (std::f64::consts::TAU * hz * since).sin() + 0.3 * (std::f64::consts::TAU * 7.3 * hz * since).sin();
                if since < 0.0 { 0.0 } else { 0.3 * (-9.0 * since).exp() * tone }
            };
            (0..16).map(burst).sum::<f64>() as f32
        };
        (0..6 * SAMPLE_RATE as usize + 100).map(sample).collect()
    }

    #[test]
    fn onsets_are_those_of_librosa() {
        let golden: serde_json::Value =
            serde_json::from_str(include_str!("../../../fixtures/reference/audio_features_golden.json")).unwrap();
        let sound = bursts();
        let list = |name: &str| serde_json::from_value::<Vec<f64>>(golden["onset"][name].clone()).unwrap();
        let mut loudest = Loudest::default();
        loudest.push(&sound);
        let loudest = loudest.finish();
        let mut in_pieces = Onsets::new(loudest);
        sound.chunks(777).for_each(|piece| in_pieces.push(piece));
        let strengths = in_pieces.strengths();
        let expected = list("strengths");
        assert_eq!(strengths.len(), expected.len());
        for (i, (found, expected)) in strengths.iter().zip(&expected).enumerate() {
            assert!((f64::from(*found) - expected).abs() < 2e-3 * (1.0 + expected), "{i}: {found} {expected}");
        }
        assert_eq!(onsets(&sound), list("times"));
    }

    #[test]
    fn silence_and_nothing_have_no_onsets() {
        assert!(onsets(&[]).is_empty());
        assert!(onsets(&[0.0; 20_000]).is_empty());
        assert!(onsets(&[f32::NAN; 3000]).is_empty());
        assert_eq!(onsets(&[0.1]).len(), 0);
    }
}
