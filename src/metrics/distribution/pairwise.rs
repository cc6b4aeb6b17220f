//! Average pairwise distance of poses some seconds apart: like L1div, but without a mean pose.

use crate::math::vec3;
use crate::math::vec3::Vec3;
use crate::metrics::body_part::BodyPart;
use crate::metrics::definition::{Better, Definition, MetricFamily};
use crate::metrics::pair::PairedFrames;
use crate::metrics::sums::BlockSums;
use crate::types::skeleton::N_JOINTS;
use serde_json::json;

/// Poses are compared up to this many seconds apart.
const MOST_SECS: usize = 30;

struct Pairwise {
    part: BodyPart,
    joints: Vec<usize>,
}

pub(crate) fn metric(part: BodyPart) -> Box<dyn MetricFamily> {
    Box::new(Pairwise { part, joints: part.joints() })
}

impl MetricFamily for Pairwise {
    fn definitions(&self) -> Vec<Definition> {
        let definition = |name, better| Definition {
            name,
            part: self.part.name(),
            unit: "m",
            better,
            formula: "mean over all pairs of frames of one interval that lie 1, 2, ... whole seconds apart, the first at a \
                      whole second from the interval's start (nearest frames), of the Euclidean distance of the two \
                      poses as one vector of all joints of the part; over the joints seen in both, times \
                      sqrt(joints / seen joints)",
            undefined: "no interval is longer than a second, or no joint of the part is seen in both poses",
            parameters: json!({"every_secs": 1, "most_secs": MOST_SECS}),
        };
        let (predicted, ground_truth) = ("average_pairwise_distance", "average_pairwise_distance_of_real");
        vec![definition(predicted, Better::NearerTruth), definition(ground_truth, Better::Neither)]
    }

    fn n_sums(&self) -> usize {
        3
    }

    fn measure(&self, pair: &PairedFrames, blocks: &mut BlockSums) {
        let frame_of = |secs: usize| (secs as f64 * pair.fps).round() as usize;
        let samples: Vec<usize> = (0..).map(frame_of).take_while(|t| *t < pair.n_frames()).collect();
        for (i, &a) in samples.iter().enumerate() {
            let sums = blocks.at(a);
            for &b in samples.iter().skip(i + 1).take(MOST_SECS) {
                let seen = |joint: &&usize| pair.seen[a][**joint] && pair.seen[b][**joint];
                let n = self.joints.iter().filter(seen).count();
                if n == 0 {
                    continue;
                }
                let distance = |poses: &[[Vec3; N_JOINTS]]| {
                    let squares = self
                        .joints
                        .iter()
                        .filter(seen)
                        .map(|j| vec3::norm(vec3::sub(poses[a][*j], poses[b][*j])).powi(2));
                    (squares.sum::<f64>() * self.joints.len() as f64 / n as f64).sqrt()
                };
                sums[0] += distance(&pair.predicted);
                sums[1] += distance(&pair.ground_truth);
                sums[2] += 1.0;
            }
        }
    }

    fn values(&self, sums: &[f64]) -> Vec<f64> {
        vec![sums[0] / sums[2], sums[1] / sums[2]]
    }
}
