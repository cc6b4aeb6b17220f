//! Frechet distances of the catalogue, computed from packed moments of predicted and of ground-truth rows. A row is a
//! single pose, or a window in a fixed space. Diversity of an interval's poses, small for motion near its mean pose.

use super::frechet::between;
use super::moments;
use crate::metrics::definition::{Better, BodyPart, Definition, MetricFamily};
use crate::metrics::pair::PairedFrames;
use crate::metrics::space::fixed_rate::{self, Frames};
use crate::metrics::space::{basis, embedding};
use crate::metrics::sums::BlockSums;
use ndarray::{Array2, ArrayView2, ArrayView3};
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;
use serde_json::json;

const CM: f64 = 100.0;

/// Family of one Frechet distance of rows of length `n_features`.
fn family(
    definition: Definition,
    n_features: usize,
    measure: impl Fn(&PairedFrames, &mut BlockSums) + Send + Sync + 'static,
) -> MetricFamily {
    let n_sums = 2 * moments::packed_len(n_features);
    let values = move |sums: &[f64]| vec![distance(sums, n_features)];
    MetricFamily { is_costly: true, ..MetricFamily::new(vec![definition], n_sums, measure, values) }
}

/// Frechet distance of single poses of all 48 joints (144 coordinates) or of the body (18).
pub(crate) fn poses(part: BodyPart) -> MetricFamily {
    let joints = part.joints();
    let d = 3 * joints.len();
    let definition = Definition {
        formula: "|m_p - m_g|^2 + trace(C_p + C_g - 2 sqrt(C_p C_g)), m and C mean and unbiased covariance of the rows; a \
                  row is the pose of one frame, x, y, z of all joints of the part in centimetres from the neck; frames \
                  in which not all of them are seen are left out",
        undefined: "fewer than 2 frames have all joints of the part visible",
        parameters: json!({"n_numbers": d}),
        ..Definition::new("frechet_pose", part.name(), "cm^2", Better::Lower)
    };
    family(definition, d, move |pair, blocks| {
        let rows = |poses: &[[Vec3; N_JOINTS]], frames: &[usize]| {
            Array2::from_shape_fn((frames.len(), d), |(row, i)| CM * poses[frames[row]][joints[i / 3]][i % 3])
        };
        for (block, frames) in pair.complete_frames(&joints, blocks).iter().enumerate() {
            let (predicted, ground_truth) = blocks.row(block).split_at_mut(moments::packed_len(d));
            moments::add(rows(&pair.predicted, frames).view(), predicted);
            moments::add(rows(&pair.ground_truth, frames).view(), ground_truth);
        }
    })
}

/// Frechet distance of windows in a fixed space.
struct FixedSpace {
    name: &'static str,
    formula: &'static str,
    hash: String,
    /// Computes the rows of all windows from joints, mask and frame rate.
    windows: fn(ArrayView3<f32>, ArrayView2<bool>, FrameRate) -> Array2<f64>,
    n_frames: usize,
    stride: usize,
    n_features: usize,
}

/// Frechet distance of windows of 15 frames in the fixed basis.
pub(crate) fn basis() -> MetricFamily {
    in_space(FixedSpace {
        name: "frechet_window",
        formula: "|m_p - m_g|^2 + trace(C_p + C_g - 2 sqrt(C_p C_g)), m and C mean and unbiased covariance of the rows; a row \
                  is a window of wholly seen frames at 15 a second (46 joints, weighted centimetres, fingers from their \
                  wrist) as its 64 numbers in the fixed basis (models/motion_basis.md)",
        hash: basis::hash(),
        windows: basis::windows,
        n_frames: basis::WINDOW,
        stride: basis::STRIDE,
        n_features: basis::N,
    })
}

/// Frechet distance of windows of 34 frames in the built-in embedding.
pub(crate) fn embedding() -> MetricFamily {
    in_space(FixedSpace {
        name: "frechet_embedding",
        formula: "|m_p - m_g|^2 + trace(C_p + C_g - 2 sqrt(C_p C_g)), m and C mean and unbiased covariance of the rows; a row \
                  is what the shipped encoder (models/motion_embedding.md) makes of a window of wholly seen frames at 15 \
                  a second",
        hash: embedding::hash(),
        windows: embedding::windows,
        n_frames: embedding::WINDOW,
        stride: embedding::STRIDE,
        n_features: embedding::N,
    })
}

fn in_space(space: FixedSpace) -> MetricFamily {
    let FixedSpace { name, formula, hash, windows, n_frames, stride, n_features } = space;
    let definition = Definition {
        formula,
        undefined: "fewer than 2 windows have all joints visible in every frame",
        parameters: json!({"n_frames": n_frames, "stride": stride, "n_numbers": n_features, "space": hash}),
        ..Definition::new(name, "all", "1", Better::Lower)
    };
    family(definition, n_features, move |pair, blocks| {
        let interval = &pair.interval;
        // Joints that are missing in one motion are masked in both.
        let mut mask = interval.mask.to_owned();
        for ((t, joint), visible) in mask.indexed_iter_mut() {
            *visible &= pair.visible.get(t).is_some_and(|visible| visible.get(joint) == Some(&true));
        }
        let starts = Frames::new(interval.ground_truth, mask.view(), interval.fps).starts(n_frames, stride);
        let length = moments::packed_len(n_features);
        for (i, joints) in [interval.predicted, interval.ground_truth].into_iter().enumerate() {
            let rows = windows(joints, mask.view(), interval.fps);
            if rows.nrows() != starts.len() {
                // A predicted joint that is not finite makes its windows incomplete.
                blocks.at(0)[i * length] = f64::NAN;
                continue;
            }
            for (row, start) in rows.outer_iter().zip(&starts) {
                let t = (*start as f64 / fixed_rate::FPS.per_sec() * pair.fps) as usize;
                let own = &mut blocks.at(t)[i * length..(i + 1) * length];
                moments::add(row.insert_axis(ndarray::Axis(0)), own);
            }
        }
    })
}

/// Frechet distance of two consecutive packed moments of rows of length `d`.
fn distance(sums: &[f64], d: usize) -> f64 {
    let (predicted, ground_truth) = sums.split_at(moments::packed_len(d));
    match (moments::read(predicted, d), moments::read(ground_truth, d)) {
        (Some((_, mean_predicted, predicted)), Some((_, mean_truth, ground_truth))) => {
            between((&mean_predicted, &predicted), (&mean_truth, &ground_truth))
        }
        _ => f64::NAN,
    }
}

/// L1 diversity (L1div): mean L1 distance of the poses from the mean pose of their interval (Liu et al. 2024, EMAGE,
/// `metric.py` in their repository).
pub(crate) fn l1div(part: BodyPart) -> MetricFamily {
    let joints = part.joints();
    let definition = Definition {
        formula: "sum over j and the coordinates x, y, z of the mean over all frames of |x - mean of x over its interval|, \
                  frames of all intervals pooled; of each joint the frames in which it is seen, and no joint that \
                  never is",
        undefined: "no joint of the part is visible",
        ..Definition::new("l1div", part.name(), "m", Better::NearerTruth)
    };
    let n_sums = 3 * joints.len();
    let measure = move |pair: &PairedFrames, blocks: &mut BlockSums| {
        for (i, &joint) in joints.iter().enumerate() {
            let visible: Vec<usize> = (0..pair.n_frames()).filter(|t| pair.visible[*t][joint]).collect();
            let mean = |poses: &[[Vec3; N_JOINTS]]| -> Vec3 {
                std::array::from_fn(|k| visible.iter().map(|t| poses[*t][joint][k]).sum::<f64>() / visible.len() as f64)
            };
            let (predicted, ground_truth) = (mean(&pair.predicted), mean(&pair.ground_truth));
            for &t in &visible {
                let sums = &mut blocks.at(t)[3 * i..3 * i + 3];
                let deviation = |x: Vec3, mean: Vec3| (0..3).map(|k| (x[k] - mean[k]).abs()).sum::<f64>();
                sums[0] += deviation(pair.predicted[t][joint], predicted);
                sums[1] += deviation(pair.ground_truth[t][joint], ground_truth);
                sums[2] += 1.0;
            }
        }
    };
    let total = |sums: &[f64], which: usize| {
        let of_joints = sums.chunks_exact(3).filter(|row| row[2] != 0.0).map(|row| row[which] / row[2]);
        of_joints.reduce(|a, b| a + b).unwrap_or(f64::NAN)
    };
    let values = move |sums: &[f64]| vec![total(sums, 0), total(sums, 1)];
    MetricFamily::new(definition.with_truth("l1div_of_real").into(), n_sums, measure, values)
}

/// Largest time between two compared poses, seconds.
const MAX_SECS: usize = 30;

/// Average pairwise distance of poses at different times: like L1div, but without a mean pose.
pub(crate) fn pairwise(part: BodyPart) -> MetricFamily {
    let joints = part.joints();
    let definition = Definition {
        formula: "mean over all pairs of frames of one interval that lie 1, 2, ... whole seconds apart, the first at a \
                  whole second from the interval's start (nearest frames), of the Euclidean distance of the two \
                  poses as one vector of all joints of the part; over the joints seen in both, times \
                  sqrt(joints / seen joints)",
        undefined: "no interval is longer than a second, or no joint of the part is visible in both poses",
        parameters: json!({"every_secs": 1, "most_secs": MAX_SECS}),
        ..Definition::new("average_pairwise_distance", part.name(), "m", Better::NearerTruth)
    };
    MetricFamily::mean_of_both(definition.with_truth("average_pairwise_distance_of_real"), move |pair, blocks| {
        let frame_of = |secs: usize| (secs as f64 * pair.fps).round() as usize;
        let samples: Vec<usize> = (0..).map(frame_of).take_while(|t| *t < pair.n_frames()).collect();
        for (i, &a) in samples.iter().enumerate() {
            let sums = blocks.at(a);
            for &b in samples.iter().skip(i + 1).take(MAX_SECS) {
                let visible = joints.iter().copied().filter(|joint| pair.visible[a][*joint] && pair.visible[b][*joint]);
                let n = visible.clone().count();
                if n == 0 {
                    continue;
                }
                let distance = |poses: &[[Vec3; N_JOINTS]]| {
                    let squares = visible.clone().map(|j| vec3::norm(vec3::sub(poses[a][j], poses[b][j])).powi(2));
                    (squares.sum::<f64>() * joints.len() as f64 / n as f64).sqrt()
                };
                sums[0] += distance(&pair.predicted);
                sums[1] += distance(&pair.ground_truth);
                sums[2] += 1.0;
            }
        }
    })
}
