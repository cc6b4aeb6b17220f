//! Augmentation of training windows, against overfitting to little speech: changes that a speaker's gestures do not
//! depend on. Time shift and speed, gain and pitch, background noise, masked bands and frames (SpecAugment, Park et al.
//! 2019), and mirrored poses.

use crate::generate::generator::mel_frames;
use crate::generate::normalisation::Normalisation;
use crate::train::resume;
use ndarray::{Array2, Axis, s};
use orator_base::audio::mel;
use orator_base::types::skeleton::{self, N_JOINTS};
use orator_base::types::time::FrameRate;
use orator_dataset::config::GanSettings;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Spectrogram frames per second.
const MEL_RATE: f64 = 100.0;
/// Seed modifier that makes augmentation independent of the choice of windows.
const SEED_OF_CHANGES: u64 = 0x6368_616e_6765;
/// Knots of the piecewise linear noise spectrum over the bands.
const NOISE_KNOTS: usize = 5;

#[derive(Clone, Debug, Default)]
pub struct WindowChange {
    /// Offset of the start of the window, seconds; negative is earlier.
    pub shift_secs: f64,
    /// Playback speed: seconds of the interval per second of the window.
    pub speed: f64,
    pub is_mirrored: bool,
    /// Mel bands by which the sound is raised.
    pub pitch_bands: f64,
    /// Added to the logarithms of the mels.
    pub gain: f32,
    /// Mean magnitude of the noise relative to that of the window; 0: no noise.
    pub noise: f32,
    /// First band and the one after the last that are set to the mean.
    pub masked_bands: [usize; 2],
    /// Likewise the mel frames.
    pub masked_frames: [usize; 2],
    /// Of the noise.
    pub seed: u64,
}

/// Augmented window: spectrogram [64, mel frames], poses [features, T] and their mask [features, T].
pub struct WindowRows {
    pub mels: Array2<f32>,
    pub poses: Array2<f32>,
    pub mask: Array2<f32>,
}

/// Changes of the windows of the step after `step` completed steps; empty if the settings disable all augmentation.
pub fn changes(settings: &GanSettings, step: usize, fps: FrameRate) -> Vec<WindowChange> {
    let of = settings;
    let is_changing = of.augment_speed > 0.0
        || of.augment_pitch > 0.0
        || of.augment_gain_db > 0.0
        || of.augment_noise_db > -120.0
        || of.augment_mask_bands > 0
        || of.augment_mask_secs > 0.0
        || of.augment_mirror > 0.0;
    if !is_changing {
        return Vec::new();
    }
    let mut rng = resume::step_rng(settings.seed ^ SEED_OF_CHANGES, step);
    let max_shift = 0.5 * fps.secs(settings.stride_frames);
    let n_mels = mel_frames(fps, settings.window_frames);
    (0..settings.batch).map(|_| WindowChange::draw(settings, max_shift, n_mels, &mut rng)).collect()
}

impl WindowChange {
    fn draw(of: &GanSettings, max_shift: f64, n_mels: usize, rng: &mut ChaCha8Rng) -> Self {
        let mut within = |limit: f64| (2.0 * rng.random::<f64>() - 1.0) * limit;
        let shift_secs = within(max_shift);
        let speed = within(of.augment_speed).exp();
        let pitch_bands = within(of.augment_pitch);
        let gain = (within(of.augment_gain_db) * std::f64::consts::LN_10 / 20.0) as f32;
        let noise_db = of.augment_noise_db - 15.0 * (1.0 + within(1.0));
        let noise = if of.augment_noise_db > -120.0 { 10f64.powf(noise_db / 20.0) as f32 } else { 0.0 };
        let mut span = |longest: usize, n: usize| {
            let length = rng.random_range(0..=longest.min(n) as u64) as usize;
            let first = rng.random_range(0..=(n - length) as u64) as usize;
            [first, first + length]
        };
        let masked_bands = span(of.augment_mask_bands, mel::N_MELS);
        let masked_frames = span((of.augment_mask_secs * MEL_RATE) as usize, n_mels);
        let is_mirrored = rng.random_bool(of.augment_mirror.clamp(0.0, 1.0));
        let seed = rng.random();
        Self { shift_secs, speed, is_mirrored, pitch_bands, gain, noise, masked_bands, masked_frames, seed }
    }

    /// Applies the audio changes in place to the log-mels [64, mel frames] of a window.
    pub fn change_sound(&self, mels: &mut Array2<f32>) {
        let silence = mel::FLOOR.ln();
        if self.pitch_bands != 0.0 {
            let source = mels.clone();
            let last = (mels.nrows() - 1) as f64;
            for (band, mut row) in mels.outer_iter_mut().enumerate() {
                let at = (band as f64 - self.pitch_bands).clamp(0.0, last);
                let (low, share) = (at as usize, at.fract() as f32);
                let high = (low + 1).min(source.nrows() - 1);
                row.assign(&source.row(low));
                row.zip_mut_with(&source.row(high), |own, next| *own += share * (next - *own));
            }
        }
        if self.gain != 0.0 {
            mels.mapv_inplace(|x| (x + self.gain).max(silence));
        }
        if self.noise > 0.0 {
            self.add_noise(mels);
        }
        let mean = mels.mean().unwrap_or(silence);
        let [first, last] = self.masked_bands;
        mels.slice_mut(s![first..last, ..]).fill(mean);
        let n = mels.ncols();
        let [first, last] = self.masked_frames.map(|frame| frame.min(n));
        mels.slice_mut(s![.., first..last]).fill(mean);
    }

    /// Adds noise magnitudes with a random, smooth spectrum.
    fn add_noise(&self, mels: &mut Array2<f32>) {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let level = self.noise * mels.iter().map(|x| x.exp()).sum::<f32>() / mels.len().max(1) as f32;
        let knots: [f32; NOISE_KNOTS] = std::array::from_fn(|_| rng.random_range(-1.0f32..1.0).exp());
        let n = mels.nrows();
        for (band, mut row) in mels.axis_iter_mut(Axis(0)).enumerate() {
            let at = band as f32 * (NOISE_KNOTS - 1) as f32 / n as f32;
            let (low, share) = (at as usize, at.fract());
            let height = level * (knots[low] + share * (knots[(low + 1).min(NOISE_KNOTS - 1)] - knots[low]));
            row.mapv_inplace(|x| {
                // The magnitudes of a noise band vary little around their mean.
                let magnitude = height * (0.75 + 0.5 * rng.random::<f32>());
                (x.exp() + magnitude).ln()
            });
        }
    }
}

/// Mirrors normalised poses [features, T] and their mask in place: swaps left and right, and flips the sign of x.
pub fn mirror(poses: &mut Array2<f32>, mask: &mut Array2<f32>, normal: &Normalisation) {
    let (source, source_mask) = (poses.clone(), mask.clone());
    for joint in 1..N_JOINTS {
        for k in 0..3 {
            let (to, from) = (3 * (joint - 1) + k, 3 * (skeleton::mirror(joint) - 1) + k);
            let sign = if k == 0 { -1.0 } else { 1.0 };
            let (mean, std) = (normal.mean[to], normal.std[to].max(1e-6));
            let metres = source.row(from).mapv(|x| sign * (x * normal.std[from] + normal.mean[from]));
            poses.row_mut(to).assign(&metres.mapv(|x| (x - mean) / std));
            mask.row_mut(to).assign(&source_mask.row(from));
        }
    }
    // Yaw and roll change their sign, pitch does not.
    for (n, of) in normal.channels.iter().enumerate() {
        for k in [0, 2] {
            let row = 3 * (N_JOINTS - 1) + 3 * n + k;
            let (mean, std) = (of.mean[k], of.std[k].max(1e-6));
            poses.row_mut(row).mapv_inplace(|x| (-(x * std + mean) - mean) / std);
        }
    }
    poses.zip_mut_with(mask, |x, seen| *x *= seen);
}

/// `n` samples of Gaussian noise with standard deviation `std`, determined by seed and step.
pub fn gaussian(n: usize, std: f64, seed: u64, step: usize) -> Vec<f32> {
    let mut rng = resume::step_rng(seed ^ !SEED_OF_CHANGES, step);
    (0..n).map(|_| (std * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut rng)) as f32).collect()
}
