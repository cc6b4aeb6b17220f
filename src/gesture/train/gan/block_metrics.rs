//! Accumulators over held-out blocks, from which the metrics of a validation are computed.

use super::score::{ChannelError, ErrorReduction, ValidationMetrics};
use super::windows::WindowBatch;
use crate::metrics::distribution::frechet::{self, GaussianFit, frechet};
use crate::metrics::movement::derivatives::MotionEnergy;
use crate::metrics::position::pck::{CorrectKeypoints, PckAxes};
use anyhow::Result;
use candle_core::Tensor;
use ndarray::{Array2, Array3, ArrayView2, ArrayView3};
use orator_base::types::skeleton::{N_JOINTS, NECK, is_duplicate, parent};
use orator_base::types::time::FrameRate;

/// Held-out block: the prediction for its sound and the ground truth, each [T, 49, 3] in metres, and the mask [T, 49].
pub struct HeldOutBlock {
    pub predicted: Array3<f32>,
    pub ground_truth: Array3<f32>,
    pub mask: Array2<bool>,
}

/// Frame rate of the poses, and the joints that enter the Frechet distance.
pub struct BlockSettings {
    pub fps: FrameRate,
    pub joints: Vec<usize>,
}

/// Collects normalised blocks, for mean absolute errors per block.
#[derive(Default)]
pub struct BlockErrors {
    blocks: Vec<NormalisedBlock>,
}

/// Normalised features of a block, each [features, T].
pub struct NormalisedBlock {
    pub predicted: Array2<f32>,
    pub ground_truth: Array2<f32>,
    /// 1 where the ground truth is known, 0 elsewhere.
    pub mask: Array2<f32>,
}

impl BlockErrors {
    pub fn push(&mut self, block: NormalisedBlock) {
        self.blocks.push(block);
    }

    /// Sum of the absolute errors of each block and the number of its known features, for the predictions given by
    /// `prediction` (`None`: zeros, the mean pose).
    fn sums<'a>(&'a self, prediction: impl Fn(usize) -> Option<ArrayView2<'a, f32>>) -> Vec<[f64; 2]> {
        let sum = |(i, block): (usize, &NormalisedBlock)| {
            let mut sum = [0.0; 2];
            let predicted = prediction(i);
            for ((at, truth), mask) in block.ground_truth.indexed_iter().zip(&block.mask) {
                let value = predicted.as_ref().map_or(0.0, |values| values[at]);
                sum[0] += f64::from((value - truth).abs() * mask);
                sum[1] += f64::from(*mask);
            }
            sum
        };
        self.blocks.iter().enumerate().map(sum).collect()
    }

    /// Error sums per block (see `sums`) of the predictions, of the mean pose, and of mismatched predictions: those for
    /// the sound of the block half of all blocks further on.
    pub fn by_block(&self) -> [Vec<[f64; 2]>; 3] {
        let n = self.blocks.len();
        let own = self.sums(|i| Some(self.blocks[i].predicted.view()));
        let mean_pose = self.sums(|_| None);
        let mismatched = self.sums(|i| Some(self.blocks[(i + n / 2) % n.max(1)].predicted.view()));
        [own, mean_pose, mismatched]
    }
}

/// Mean error over all features of all blocks, from the error sums per block.
pub fn mean_error(blocks: &[[f64; 2]]) -> f64 {
    let [sum, n] = blocks.iter().fold([0.0; 2], |[sum, n], block| [sum + block[0], n + block[1]]);
    sum / n.max(1.0)
}

/// Relative reduction of the mean error from `other` to `own` on the same blocks, with the 95 % confidence interval of
/// a ratio estimator over blocks (Cochran 1977, section 6.4).
pub fn reduction(own: &[[f64; 2]], other: &[[f64; 2]]) -> ErrorReduction {
    let (of_own, of_other) = (mean_error(own), mean_error(other).max(1e-9));
    let ratio = of_own / of_other;
    let n = own.len() as f64;
    let weight = own.iter().map(|block| block[1]).sum::<f64>() / n.max(1.0);
    let squares = own.iter().zip(other).map(|(own, other)| ((own[0] - ratio * other[0]) / weight.max(1.0)).powi(2));
    let half_width = match own.len() {
        0 | 1 => f64::INFINITY,
        _ => 1.96 * (squares.sum::<f64>() / (n - 1.0) / n).sqrt() / of_other,
    };
    let value = 1.0 - ratio;
    // JSON cannot represent the infinite interval of a single block.
    let bound = |bound: f64| bound.is_finite().then_some(bound);
    ErrorReduction { value, low: bound(value - half_width), high: bound(value + half_width) }
}

#[derive(Default)]
pub struct PredictorSums {
    correct: CorrectKeypoints,
    energy: MotionEnergy,
    pub poses: GaussianFit,
}

impl PredictorSums {
    pub fn add(&mut self, predicted: ArrayView3<f32>, window: &HeldOutBlock, of: &BlockSettings) {
        self.correct.count(PckAxes::Xyz, predicted, window.ground_truth.view(), window.mask.view());
        self.energy.add(predicted, window.mask.view(), of.fps);
        self.poses += &GaussianFit::fit(frechet::poses(predicted, window.mask.view(), &of.joints).view());
    }

    /// Metrics relative to the ground truth; `l1` comes from [`BlockErrors`].
    pub fn metrics(&self, ground_truth: &Self, l1: f64) -> ValidationMetrics {
        ValidationMetrics {
            l1,
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

/// Accumulated angle errors of a posture channel, degrees.
#[derive(Default)]
pub struct AngleSums {
    generator: RunningMean,
    mean_pose: RunningMean,
}

impl AngleSums {
    /// Adds a batch whose angles are the features `first..first + 3`; `std` are their standard deviations in radians.
    pub fn add(&mut self, poses: &Tensor, batch: &WindowBatch, first: usize, std: [f32; 3]) -> Result<()> {
        for (k, std) in std.into_iter().enumerate() {
            let values = |x: &Tensor| -> Result<Vec<f32>> { Ok(x.get_on_dim(1, first + k)?.flatten_all()?.to_vec1()?) };
            let [predicted, real, mask] = [values(poses)?, values(&batch.poses)?, values(&batch.mask)?];
            let degrees = |normalised: f32| f64::from((normalised * std).abs().to_degrees());
            for ((predicted, real), _) in predicted.iter().zip(&real).zip(&mask).filter(|(_, seen)| **seen > 0.0) {
                self.generator.add([degrees(predicted - real)]);
                self.mean_pose.add([degrees(*real)]);
            }
        }
        Ok(())
    }

    pub fn error(&self) -> ChannelError {
        ChannelError { generator: self.generator.mean(), mean_pose: self.mean_pose.mean() }
    }
}

#[derive(Default)]
pub struct RunningMean {
    sum: f64,
    n: usize,
}

impl RunningMean {
    pub fn add(&mut self, values: impl IntoIterator<Item = f64>) {
        for value in values {
            self.sum += value;
            self.n += 1;
        }
    }

    pub fn mean(&self) -> f64 {
        self.sum / self.n.max(1) as f64
    }
}

/// Mean distance between the joints of consecutive windows at the same frame, where both are visible.
#[derive(Default)]
pub struct BlockDistance {
    last: Option<(Array3<f32>, Array3<f32>, Array2<bool>)>,
    predicted: RunningMean,
    ground_truth: RunningMean,
}

impl BlockDistance {
    pub fn add(&mut self, window: &HeldOutBlock) {
        if let Some((predicted, ground_truth, mask)) = &self.last {
            for ((t, joint), seen) in window.mask.indexed_iter() {
                if *seen && mask[[t, joint]] && !is_duplicate(joint) {
                    let distance = |a: &Array3<f32>, b: &Array3<f32>| {
                        (0..3).map(|k| f64::from(a[[t, joint, k]] - b[[t, joint, k]]).powi(2)).sum::<f64>().sqrt()
                    };
                    self.predicted.add([distance(predicted, &window.predicted)]);
                    self.ground_truth.add([distance(ground_truth, &window.ground_truth)]);
                }
            }
        }
        self.last = Some((window.predicted.clone(), window.ground_truth.clone(), window.mask.clone()));
    }

    /// Ratio of the distances of the predictions to those of the ground truth; 1 for a single window.
    pub fn ratio(&self) -> f64 {
        if self.ground_truth.mean() > 0.0 { self.predicted.mean() / self.ground_truth.mean() } else { 1.0 }
    }
}

/// Absolute change of the length of every bone between consecutive frames, metres.
pub fn bone_changes(joints: ArrayView3<f32>) -> Vec<f64> {
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
