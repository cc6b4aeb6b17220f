//! Diversity of the poses of an interval, which is small for motion that stays near its mean pose.

use crate::metrics::body_part::BodyPart;
use crate::metrics::definition::{Better, Definition, MetricFamily};
use crate::metrics::pair::PairedFrames;
use crate::metrics::sums::BlockSums;
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::skeleton::N_JOINTS;
use serde_json::json;

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
