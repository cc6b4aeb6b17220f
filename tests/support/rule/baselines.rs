//! Baselines for models of a rule-based speaker, fitted to the training split: ridge regression from the audio of the
//! same frame and of one second, nearest neighbour by audio, and the mean pose.

use super::context_ridge::{AudioContext, ContextRidge, TrainingClip};
use anyhow::{Result, ensure};
use ndarray::{Array2, Array3, ArrayView3, Axis, concatenate, s};
use orator_base::audio::mel;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::sound::{Sound, sample_at, samples_of};
use orator_base::types::time::FrameRate;
use orator_dataset::{Dataset, Sample, Split};
use rayon::prelude::*;

/// Window length of the nearest neighbour, frames.
const WINDOW: usize = 64;
/// Audio context of the two ridge regressions: the frame alone, and one second, mostly before the frame.
const FRAME: AudioContext = AudioContext { before: 0, after: 0 };
const SECOND: AudioContext = AudioContext { before: 13, after: 1 };

/// Log-mel spectrogram per motion frame, [T, 64]: mean over the hops that begin in the frame.
pub fn frame_log_mel(sound: &Sound, n_frames: usize, fps: FrameRate) -> Array2<f64> {
    let mut samples = sound.samples.clone();
    samples.resize(sample_at(fps, sound.rate, n_frames) + mel::WINDOW, 0.0);
    let mels = mel::log_mel(&samples);
    let mut frames = Array2::zeros((n_frames, mel::N_MELS));
    for (t, mut frame) in frames.outer_iter_mut().enumerate() {
        let hops = samples_of(fps, sound.rate, t..t + 1);
        let (first, last) = (hops.start.div_ceil(mel::HOP), hops.end.div_ceil(mel::HOP).min(mels.nrows()));
        let mean = mels.slice(s![first.min(last.saturating_sub(1))..last, ..]).mean_axis(Axis(0));
        frame.assign(&mean.unwrap_or_default().mapv(f64::from));
    }
    frames
}

/// Baselines fitted to the training split.
pub struct RuleBaselines {
    /// Regressions from the audio of the frame, and of one second.
    pub ridges: [ContextRidge; 2],
    /// Audio features [64, 64] and joints [64, 49, 3] of the training windows.
    windows: Vec<(Array2<f64>, Array3<f32>)>,
    mean: Array2<f32>,
}

impl RuleBaselines {
    /// Fits to the training split; the validation split selects the penalties.
    ///
    /// # Errors
    /// An empty split; samples that cannot be read.
    pub fn fit(dataset: &Dataset) -> Result<Self> {
        let fps = dataset.info().fps;
        let (train, validation) = (clips(dataset, Split::Train)?, clips(dataset, Split::Validation)?);
        ensure!(
            !train.is_empty() && !validation.is_empty(),
            "the train or validation split of {} is empty",
            dataset.dir().display()
        );
        let windows = train.iter().flat_map(|clip| {
            let starts = (0..clip.sound.nrows() / WINDOW).map(|n| n * WINDOW);
            starts.map(|t| {
                let frames = t..t + WINDOW;
                (clip.sound.slice(s![frames.clone(), ..]).to_owned(), clip.joints.slice(s![frames, .., ..]).to_owned())
            })
        });
        Ok(Self {
            ridges: [FRAME, SECOND].map(|context| ContextRidge::fit(context, &train, &validation, fps)),
            windows: windows.collect(),
            mean: dataset.stats().mean(),
        })
    }

    /// Joints of the training windows with the nearest audio, in windows of 64 frames.
    pub fn nearest(&self, sound: &Array2<f64>) -> Array3<f32> {
        let starts: Vec<usize> = (0..sound.nrows()).step_by(WINDOW).collect();
        let parts: Vec<Array3<f32>> = starts.par_iter().map(|&t| self.nearest_window(sound, t)).collect();
        let views: Vec<ArrayView3<f32>> = parts.iter().map(|part| part.view()).collect();
        concatenate(Axis(0), &views).unwrap_or_default()
    }

    fn nearest_window(&self, sound: &Array2<f64>, t: usize) -> Array3<f32> {
        let window = sound.slice(s![t..sound.nrows().min(t + WINDOW), ..]);
        let n = window.nrows();
        let distance = |other: &Array2<f64>| -> f64 {
            window.iter().zip(other.slice(s![..n, ..])).map(|(a, b)| (a - b).powi(2)).sum()
        };
        let nearest = self.windows.iter().min_by(|a, b| distance(&a.0).total_cmp(&distance(&b.0)));
        nearest.map_or_else(|| self.mean_pose(n), |(_, joints)| joints.slice(s![..n, .., ..]).to_owned())
    }

    /// Mean pose, repeated for `n_frames`.
    pub fn mean_pose(&self, n_frames: usize) -> Array3<f32> {
        Array3::from_shape_fn((n_frames, N_JOINTS, 3), |(_, joint, k)| self.mean[[joint, k]])
    }
}

fn clips(dataset: &Dataset, split: Split) -> Result<Vec<TrainingClip>> {
    let clip = |sample: Sample| TrainingClip {
        sound: frame_log_mel(&sample.sound, sample.n_frames(), sample.motion.fps),
        joints: sample.motion.joints,
    };
    dataset.samples(split).par_iter().map(|sample| Ok(clip(dataset.read(sample)?))).collect()
}
