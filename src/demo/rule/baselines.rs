//! Baselines for a speaker trained on the rule, learnt from the training split: ridge regression from the sound of the
//! same frame, the training window with the nearest sound, and the mean pose.

use super::ridge::{Ridge, RidgeSums};
use crate::audio::mel;
use crate::dataset::{Dataset, Sample, Split};
use crate::types::skeleton::{L_WRIST, N_JOINTS, R_WRIST};
use crate::types::sound::Sound;
use crate::types::sync;
use crate::types::time::FrameRate;
use anyhow::{Result, ensure};
use ndarray::{Array2, Array3, ArrayView3, Axis, concatenate, s};
use rayon::prelude::*;

/// Left and right wrist.
pub const WRISTS: [usize; 2] = [L_WRIST, R_WRIST];
/// Frames of a window of the nearest neighbour.
const WINDOW: usize = 64;
/// Ridge penalties; validation chooses.
const STRENGTHS: [f64; 8] = [1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0];

/// Log-mel spectrogram by motion frame [T, 64]: the mean over the hops that begin in the frame.
pub fn sound_of_frames(sound: &Sound, n_frames: usize, fps: FrameRate) -> Array2<f64> {
    let mut samples = sound.samples.clone();
    samples.resize(sync::sample_at(fps, sound.rate, n_frames) + mel::WINDOW, 0.0);
    let mels = mel::log_mel(&samples);
    let mut frames = Array2::zeros((n_frames, mel::N_MELS));
    for (t, mut frame) in frames.outer_iter_mut().enumerate() {
        let hops = sync::samples_of(fps, sound.rate, t..t + 1);
        let (first, last) = (hops.start.div_ceil(mel::HOP), hops.end.div_ceil(mel::HOP).min(mels.nrows()));
        let mean = mels.slice(s![first.min(last.saturating_sub(1))..last, ..]).mean_axis(Axis(0));
        frame.assign(&mean.unwrap_or_default().mapv(f64::from));
    }
    frames
}

/// Speed of each wrist from each frame to the next, [T - 1, 2], m/s, no smoothing.
pub fn wrist_speeds(joints: ArrayView3<f32>, fps: FrameRate) -> Array2<f64> {
    Array2::from_shape_fn((joints.shape()[0].saturating_sub(1), 2), |(t, hand)| {
        let step = |k: usize| f64::from(joints[[t + 1, WRISTS[hand], k]] - joints[[t, WRISTS[hand], k]]);
        (0..3).map(|k| step(k).powi(2)).sum::<f64>().sqrt() * fps.per_sec()
    })
}

/// Baselines fitted to the training split.
pub struct RuleBaselines {
    /// Regression to the speeds of both wrists, m/s.
    speed: Ridge,
    /// Regression to the 147 joint coordinates, metres.
    pose: Ridge,
    /// Chosen penalties of both.
    pub strengths: [f64; 2],
    /// Sound [64 x 64] and motion of the training windows.
    windows: Vec<(Array2<f64>, Array3<f32>)>,
    mean: Array2<f32>,
}

/// Sound [T, 64] and joints [T, 49, 3] of a clip.
struct TrainingClip {
    sound: Array2<f64>,
    joints: Array3<f32>,
}

impl RuleBaselines {
    /// Fits to the training split, with penalties from the validation split.
    pub fn learn(dataset: &Dataset) -> Result<Self> {
        let fps = dataset.info().fps;
        let (train, validation) = (clips(dataset, Split::Train)?, clips(dataset, Split::Validation)?);
        ensure!(!train.is_empty() && !validation.is_empty(), "{}: a split is empty", dataset.dir().display());
        let mut sums = [RidgeSums::new(mel::N_MELS, 2), RidgeSums::new(mel::N_MELS, 3 * N_JOINTS)];
        for clip in &train {
            let targets = clip.targets(fps);
            sums.iter_mut().zip(&targets).for_each(|(sums, target)| sums.add(clip.inputs(), target.view()));
        }
        let best = |which: usize| {
            let error = |ridge: &Ridge| -> f64 {
                let of = |clip: &TrainingClip| {
                    (ridge.predict(clip.inputs()) - &clip.targets(fps)[which]).mapv(|e| e * e).sum()
                };
                validation.iter().map(of).sum()
            };
            let tried = STRENGTHS.map(|strength| (error(&sums[which].ridge(strength)), strength));
            tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |(_, strength)| strength)
        };
        let strengths = [best(0), best(1)];
        let windows = train.iter().flat_map(|clip| {
            let starts = (0..clip.sound.nrows() / WINDOW).map(|n| n * WINDOW);
            starts.map(|t| {
                let frames = t..t + WINDOW;
                (clip.sound.slice(s![frames.clone(), ..]).to_owned(), clip.joints.slice(s![frames, .., ..]).to_owned())
            })
        });
        Ok(Self {
            speed: sums[0].ridge(strengths[0]),
            pose: sums[1].ridge(strengths[1]),
            strengths,
            windows: windows.collect(),
            mean: dataset.stats().mean(),
        })
    }

    /// Speeds of both wrists by ridge regression, [T - 1, 2].
    pub fn ridge_speeds(&self, sound: &Array2<f64>) -> Array2<f64> {
        self.speed.predict(sound.slice(s![..sound.nrows().saturating_sub(1), ..]))
    }

    /// Joints by ridge regression, [T, 49, 3].
    pub fn ridge_poses(&self, sound: &Array2<f64>) -> Array3<f32> {
        let numbers = self.pose.predict(sound.view());
        Array3::from_shape_fn((sound.nrows(), N_JOINTS, 3), |(t, joint, k)| numbers[[t, 3 * joint + k]] as f32)
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

impl TrainingClip {
    /// Sound [T - 1, 64] from each frame to the next.
    fn inputs(&self) -> ndarray::ArrayView2<'_, f64> {
        self.sound.slice(s![..self.sound.nrows().saturating_sub(1), ..])
    }

    /// Speeds [T - 1, 2] and coordinates [T - 1, 147].
    fn targets(&self, fps: FrameRate) -> [Array2<f64>; 2] {
        let n = self.joints.shape()[0].saturating_sub(1);
        let pose = Array2::from_shape_fn((n, 3 * N_JOINTS), |(t, i)| f64::from(self.joints[[t, i / 3, i % 3]]));
        [wrist_speeds(self.joints.view(), fps), pose]
    }
}

fn clips(dataset: &Dataset, split: Split) -> Result<Vec<TrainingClip>> {
    let clip = |sample: Sample| TrainingClip {
        sound: sound_of_frames(&sample.sound, sample.n_frames(), sample.motion.fps),
        joints: sample.motion.joints,
    };
    dataset.samples(split).par_iter().map(|sample| Ok(clip(dataset.read(sample)?))).collect()
}
