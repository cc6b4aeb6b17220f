//! Baselines for a speaker trained on the rule, learnt from the training split: ridge regression from the sound of the
//! same frame and of a second, the training window with the nearest sound, and the mean pose.

use super::ridge_listener::{HeardFrames, RidgeListener, TrainingClip};
use anyhow::{Result, ensure};
use ndarray::{Array2, Array3, ArrayView3, Axis, concatenate, s};
use orator_base::audio::mel;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::sound::{Sound, sample_at, samples_of};
use orator_base::types::time::FrameRate;
use orator_dataset::{Dataset, Sample, Split};
use rayon::prelude::*;

/// Frames of a window of the nearest neighbour.
const WINDOW: usize = 64;
/// What the two ridge regressions hear: the frame alone, and a second, most of it before the frame.
const FRAME: HeardFrames = HeardFrames { before: 0, behind: 0 };
const SECOND: HeardFrames = HeardFrames { before: 13, behind: 1 };

/// Log-mel spectrogram by motion frame [T, 64]: the mean over the hops that begin in the frame.
pub fn sound_of_frames(sound: &Sound, n_frames: usize, fps: FrameRate) -> Array2<f64> {
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
    /// Hears the frame, and a second of sound.
    pub ridges: [RidgeListener; 2],
    /// Sound [64 x 64] and motion of the training windows.
    windows: Vec<(Array2<f64>, Array3<f32>)>,
    mean: Array2<f32>,
}

impl RuleBaselines {
    /// Fits to the training split, with penalties from the validation split.
    pub fn learn(dataset: &Dataset) -> Result<Self> {
        let fps = dataset.info().fps;
        let (train, validation) = (clips(dataset, Split::Train)?, clips(dataset, Split::Validation)?);
        ensure!(!train.is_empty() && !validation.is_empty(), "{}: a split is empty", dataset.dir().display());
        let windows = train.iter().flat_map(|clip| {
            let starts = (0..clip.sound.nrows() / WINDOW).map(|n| n * WINDOW);
            starts.map(|t| {
                let frames = t..t + WINDOW;
                (clip.sound.slice(s![frames.clone(), ..]).to_owned(), clip.joints.slice(s![frames, .., ..]).to_owned())
            })
        });
        Ok(Self {
            ridges: [FRAME, SECOND].map(|heard| RidgeListener::learn(heard, &train, &validation, fps)),
            windows: windows.collect(),
            mean: dataset.stats().mean(),
        })
    }

    /// Joints of the training windows with the nearest sound, in windows of 64 frames.
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
        nearest.map_or_else(|| self.still(n), |(_, joints)| joints.slice(s![..n, .., ..]).to_owned())
    }

    /// Mean pose for `n_frames`.
    pub fn still(&self, n_frames: usize) -> Array3<f32> {
        Array3::from_shape_fn((n_frames, N_JOINTS, 3), |(_, joint, k)| self.mean[[joint, k]])
    }
}

fn clips(dataset: &Dataset, split: Split) -> Result<Vec<TrainingClip>> {
    let clip = |sample: Sample| TrainingClip {
        sound: sound_of_frames(&sample.sound, sample.n_frames(), sample.motion.fps),
        joints: sample.motion.joints,
    };
    dataset.samples(split).par_iter().map(|sample| Ok(clip(dataset.read(sample)?))).collect()
}
