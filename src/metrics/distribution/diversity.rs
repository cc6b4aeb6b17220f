//! L1div: how far poses are from the mean pose of their interval (Liu et al. 2024, EMAGE, `metric.py` of their
//! repository). A motion that hardly leaves its mean has little.

use crate::math::vec3::Vec3;
use crate::metrics::body_part::BodyPart;
use crate::metrics::definition::{Better, Definition, MetricFamily};
use crate::metrics::pair::PairedFrames;
use crate::metrics::sums::BlockSums;
use crate::types::skeleton::N_JOINTS;
use serde_json::json;

struct L1Div {
    part: BodyPart,
    joints: Vec<usize>,
}

pub(crate) fn metric(part: BodyPart) -> Box<dyn MetricFamily> {
    Box::new(L1Div { part, joints: part.joints() })
}

impl MetricFamily for L1Div {
    fn definitions(&self) -> Vec<Definition> {
        let definition = |name, better| Definition {
            name,
            part: self.part.name(),
            unit: "m",
            better,
            formula: "sum over j and the coordinates x, y, z of the mean over all frames of |x - mean of x over its interval|, \
                      frames of all intervals pooled; of each joint the frames in which it is seen, and no joint that \
                      never is",
            undefined: "no joint of the part is seen",
            parameters: json!({}),
        };
        vec![definition("l1div", Better::NearerTruth), definition("l1div_of_real", Better::Neither)]
    }

    fn n_sums(&self) -> usize {
        3 * self.joints.len()
    }

    fn measure(&self, pair: &PairedFrames, blocks: &mut BlockSums) {
        for (i, &joint) in self.joints.iter().enumerate() {
            let seen: Vec<usize> = (0..pair.n_frames()).filter(|t| pair.seen[*t][joint]).collect();
            let mean = |poses: &[[Vec3; N_JOINTS]]| -> Vec3 {
                std::array::from_fn(|k| seen.iter().map(|t| poses[*t][joint][k]).sum::<f64>() / seen.len() as f64)
            };
            let (predicted, ground_truth) = (mean(&pair.predicted), mean(&pair.ground_truth));
            for &t in &seen {
                let sums = &mut blocks.at(t)[3 * i..3 * i + 3];
                let apart = |x: Vec3, mean: Vec3| (0..3).map(|k| (x[k] - mean[k]).abs()).sum::<f64>();
                sums[0] += apart(pair.predicted[t][joint], predicted);
                sums[1] += apart(pair.ground_truth[t][joint], ground_truth);
                sums[2] += 1.0;
            }
        }
    }

    fn values(&self, sums: &[f64]) -> Vec<f64> {
        let total = |which: usize| {
            let of_joints = sums.chunks_exact(3).filter(|row| row[2] != 0.0).map(|row| row[which] / row[2]);
            of_joints.reduce(|a, b| a + b).unwrap_or(f64::NAN)
        };
        vec![total(0), total(1)]
    }
}
