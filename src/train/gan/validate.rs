//! The generator on windows it was not trained on, beside the pose that never moves from the mean.

use super::losses;
use super::recipe::settings::GanSettings;
use super::score;
use super::score::{ChannelError, Validation, ValidationMetrics};
use super::step::GanTrainer;
use super::windows::{WindowBatch, WindowLoader, needed};
use crate::dataset::{Dataset, Split};
use crate::generate::normalisation::{N_FEATURES, Normalisation};
use crate::metrics::distribution::frechet;
use crate::metrics::distribution::frechet::{GaussianFit, frechet};
use crate::metrics::movement::energy::MotionEnergy;
use crate::metrics::position::pck::{CorrectKeypoints, PckAxes};
use crate::stage::progress::Progress;
use crate::train::no_window;
use crate::types::skeleton::{L_HAND, L_WRIST, N_JOINTS, NECK, R_HAND, R_WRIST, is_duplicate, parent};
use crate::types::time::FrameRate;
use anyhow::Result;
use candle_core::Tensor;
use ndarray::{Array2, Array3, ArrayView2, ArrayView3};

/// Most windows a validation looks at.
const N_WINDOWS: usize = 256;

/// The windows to validate on.
pub struct ValidationWindows {
    split: Split,
    fps: FrameRate,
    n_frames: usize,
    batches: Vec<WindowBatch>,
    /// What poses are compared by.
    joints: Vec<usize>,
}

/// A held-out window: the prediction for its sound, and the ground truth. [T, 49, 3] metres; mask [T, 49].
pub struct ValidationWindow {
    pub predicted: Array3<f32>,
    pub ground_truth: Array3<f32>,
    pub mask: Array2<bool>,
}

impl ValidationWindows {
    /// Windows side by side, at most `N_WINDOWS` evenly chosen: of the validation split, or where that has none of the
    /// training split, which is said.
    pub fn load(
        dataset: &Dataset,
        settings: &GanSettings,
        normal: &Normalisation,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let n_frames = settings.window_frames;
        let mut split = Split::Validation;
        let mut loader = WindowLoader::load(dataset, split, normal, n_frames, n_frames)?;
        if loader.is_empty() {
            let cause = no_window::cause(dataset, split, needed(n_frames)).unwrap_or_default();
            progress.say(&format!("no window is held out, the figures below are on those to train on: {cause}"));
            split = Split::Train;
            loader = WindowLoader::load(dataset, split, normal, n_frames, n_frames)?;
        }
        let n = loader.len().min(N_WINDOWS);
        let chosen: Vec<usize> = (0..n).map(|i| i * loader.len() / n).collect();
        let batches: Vec<WindowBatch> =
            chosen.chunks(settings.batch).map(|which| loader.batch(which)).collect::<Result<_>>()?;
        let mut masks = Vec::new();
        for batch in &batches {
            for i in 0..batch.mask.dim(0)? {
                masks.push(joints_seen(features(&batch.mask, i)?.view()));
            }
        }
        let joints = frechet::joints(masks.iter().map(|mask| mask.view()));
        Ok(Self { split, fps: dataset.info().fps, n_frames, batches, joints })
    }

    /// Both predictors on the same windows.
    pub fn validate(&self, trainer: &GanTrainer) -> Result<Validation> {
        let (generator, decoder) = (trainer.listener(), &trainer.decoder);
        let normal = &trainer.metadata.normalisation;
        let (mut predicted, mut mean_pose, mut ground_truth) =
            (PredictorSums::default(), PredictorSums::default(), PredictorSums::default());
        let (mut change, mut spread) = (RunningMean::default(), WindowSpread::default());
        let mut angles: Vec<AngleSums> = normal.channels.iter().map(|_| AngleSums::default()).collect();
        let mut n_windows = 0;
        for batch in &self.batches {
            let batch = &batch.on(trainer.device())?;
            let poses = decoder.poses(&generator.forward(&batch.mels, self.n_frames, false)?.detach())?;
            let nothing = poses.zeros_like()?;
            for (n, (of, sums)) in normal.channels.iter().zip(&mut angles).enumerate() {
                sums.add(&poses, batch, N_FEATURES + 3 * n, of.std)?;
            }
            for (tally, poses) in
                [(&mut predicted, &poses), (&mut mean_pose, &nothing), (&mut ground_truth, &batch.poses)]
            {
                tally.add_error(poses, batch)?;
            }
            let windows = windows(&poses, batch, normal)?;
            let mean_pose_window = joints(&nothing, 0, normal)?;
            for window in &windows {
                predicted.add(window.predicted.view(), window, self);
                mean_pose.add(mean_pose_window.view(), window, self);
                ground_truth.add(window.ground_truth.view(), window, self);
                change.add(bone_changes(window.predicted.view()));
                spread.add(window);
            }
            n_windows += windows.len();
        }
        let (generator, mean_pose) = (predicted.metrics(&ground_truth), mean_pose.metrics(&ground_truth));
        Ok(Validation {
            split: self.split.name().to_owned(),
            n_windows,
            n_poses: ground_truth.poses.n,
            generator,
            mean_pose,
            channels: normal.channels.iter().zip(&angles).map(|(of, sums)| (of.channel, sums.error())).collect(),
            bone_change_mm: 1e3 * change.mean(),
            spread: spread.share(),
            score: score::score(&generator, &mean_pose),
            alarm: score::alarm(generator.energy, spread.share()),
        })
    }
}

fn windows(predicted: &Tensor, batch: &WindowBatch, normal: &Normalisation) -> Result<Vec<ValidationWindow>> {
    let window = |i: usize| -> Result<ValidationWindow> {
        let mask = joints_seen(features(&batch.mask, i)?.view());
        Ok(ValidationWindow {
            predicted: joints(predicted, i, normal)?,
            ground_truth: joints(&batch.poses, i, normal)?,
            mask,
        })
    };
    (0..predicted.dim(0)?).map(window).collect()
}

fn joints(poses: &Tensor, i: usize, normal: &Normalisation) -> Result<Array3<f32>> {
    Ok(normal.joints(features(poses, i)?.view()))
}

fn features(x: &Tensor, i: usize) -> Result<Array2<f32>> {
    let values = x.get(i)?.flatten_all()?.to_vec1::<f32>()?;
    let n_numbers = x.dim(1)?;
    Ok(Array2::from_shape_vec((n_numbers, values.len() / n_numbers), values)?)
}

/// A predictor's sums so far.
#[derive(Default)]
struct PredictorSums {
    error: f64,
    n_numbers: f64,
    correct: CorrectKeypoints,
    energy: MotionEnergy,
    poses: GaussianFit,
}

impl PredictorSums {
    fn add_error(&mut self, predicted: &Tensor, batch: &WindowBatch) -> Result<()> {
        let seen = f64::from(batch.mask.sum_all()?.to_scalar::<f32>()?);
        self.error += f64::from(losses::l1(predicted, &batch.poses, &batch.mask)?.to_scalar::<f32>()?) * seen;
        self.n_numbers += seen;
        Ok(())
    }

    fn add(&mut self, predicted: ArrayView3<f32>, window: &ValidationWindow, of: &ValidationWindows) {
        self.correct.count(PckAxes::Xyz, predicted, window.ground_truth.view(), window.mask.view());
        self.energy.add(predicted, window.mask.view(), of.fps);
        self.poses += &GaussianFit::fit(frechet::poses(predicted, window.mask.view(), &of.joints).view());
    }

    fn metrics(&self, ground_truth: &Self) -> ValidationMetrics {
        ValidationMetrics {
            l1: self.error / self.n_numbers.max(1.0),
            pck: self.correct.share(),
            pck_body: self.correct.body.share(),
            pck_hands: self.correct.hands.share(),
            frechet: Some(frechet(&self.poses, &ground_truth.poses)).filter(|distance| distance.is_finite()),
            energy: Some(self.energy.relative_to(&ground_truth.energy))
                .filter(|share| share.is_finite())
                .unwrap_or(0.0),
        }
    }
}

/// Errors of the angles of a channel so far, degrees.
#[derive(Default)]
struct AngleSums {
    generator: RunningMean,
    mean_pose: RunningMean,
}

impl AngleSums {
    /// Adds a batch whose angles begin at number `first`, with these deviations in radians.
    fn add(&mut self, poses: &Tensor, batch: &WindowBatch, first: usize, std: [f32; 3]) -> Result<()> {
        for (k, std) in std.into_iter().enumerate() {
            let numbers =
                |x: &Tensor| -> Result<Vec<f32>> { Ok(x.get_on_dim(1, first + k)?.flatten_all()?.to_vec1()?) };
            let [made, real, mask] = [numbers(poses)?, numbers(&batch.poses)?, numbers(&batch.mask)?];
            let degrees = |normalised: f32| f64::from((normalised * std).abs().to_degrees());
            for ((made, real), _) in made.iter().zip(&real).zip(&mask).filter(|(_, seen)| **seen > 0.0) {
                self.generator.add([degrees(made - real)]);
                self.mean_pose.add([degrees(*real)]);
            }
        }
        Ok(())
    }

    fn error(&self) -> ChannelError {
        ChannelError { generator: self.generator.mean(), mean_pose: self.mean_pose.mean() }
    }
}

/// A running mean.
#[derive(Default)]
struct RunningMean {
    sum: f64,
    n: usize,
}

impl RunningMean {
    fn add(&mut self, values: impl IntoIterator<Item = f64>) {
        for value in values {
            self.sum += value;
            self.n += 1;
        }
    }

    fn mean(&self) -> f64 {
        self.sum / self.n.max(1) as f64
    }
}

/// How far windows that follow each other in the set lie apart, at the same frame, where both are seen.
#[derive(Default)]
struct WindowSpread {
    last: Option<(Array3<f32>, Array3<f32>, Array2<bool>)>,
    predicted: RunningMean,
    ground_truth: RunningMean,
}

impl WindowSpread {
    fn add(&mut self, window: &ValidationWindow) {
        if let Some((predicted, ground_truth, mask)) = &self.last {
            for ((t, joint), seen) in window.mask.indexed_iter() {
                if *seen && mask[[t, joint]] && !is_duplicate(joint) {
                    let apart = |a: &Array3<f32>, b: &Array3<f32>| {
                        (0..3).map(|k| f64::from(a[[t, joint, k]] - b[[t, joint, k]]).powi(2)).sum::<f64>().sqrt()
                    };
                    self.predicted.add([apart(predicted, &window.predicted)]);
                    self.ground_truth.add([apart(ground_truth, &window.ground_truth)]);
                }
            }
        }
        self.last = Some((window.predicted.clone(), window.ground_truth.clone(), window.mask.clone()));
    }

    /// 1 for a single window, which has none to differ from.
    fn share(&self) -> f64 {
        if self.ground_truth.mean() > 0.0 { self.predicted.mean() / self.ground_truth.mean() } else { 1.0 }
    }
}

/// Changes of every bone's length from frame to frame, metres.
fn bone_changes(joints: ArrayView3<f32>) -> Vec<f64> {
    let length = |t: usize, joint: usize| {
        let from = parent(joint).unwrap_or(NECK);
        (0..3).map(|k| f64::from(joints[[t, joint, k]] - joints[[t, from, k]]).powi(2)).sum::<f64>().sqrt()
    };
    let bones = (1..N_JOINTS).filter(|joint| !is_duplicate(*joint));
    bones
        .flat_map(|joint| {
            (1..joints.len_of(ndarray::Axis(0))).map(move |t| (length(t, joint) - length(t - 1, joint)).abs())
        })
        .collect()
}

/// Mask of numbers [144 or more, T] to mask of joints [T, 49]; the hand roots are seen where the wrists are.
fn joints_seen(mask: ArrayView2<f32>) -> Array2<bool> {
    Array2::from_shape_fn((mask.ncols(), N_JOINTS), |(t, joint)| match joint {
        NECK => true,
        L_HAND => mask[[3 * (L_WRIST - 1), t]] > 0.0,
        R_HAND => mask[[3 * (R_WRIST - 1), t]] > 0.0,
        _ => mask[[3 * (joint - 1), t]] > 0.0,
    })
}
