//! L1div: how far poses are from the mean pose of their interval (Liu et al. 2024, EMAGE, `metric.py` of their
//! repository). A motion that hardly leaves its mean has little.

use crate::metrics::body_part::Part;
use crate::metrics::definition::{Better, Definition, Metric};
use crate::metrics::pair::{Pair, Point};
use crate::metrics::sums::Blocks;
use crate::types::skeleton::N_JOINTS;
use serde_json::json;

struct L1Div {
    part: Part,
    joints: Vec<usize>,
}

pub(crate) fn metric(part: Part) -> Box<dyn Metric> {
    Box::new(L1Div { part, joints: part.joints() })
}

impl Metric for L1Div {
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

    fn measure(&self, pair: &Pair, blocks: &mut Blocks) {
        for (i, &joint) in self.joints.iter().enumerate() {
            let seen: Vec<usize> = (0..pair.n_frames()).filter(|t| pair.seen[*t][joint]).collect();
            let mean = |poses: &[[Point; N_JOINTS]]| -> Point {
                std::array::from_fn(|k| seen.iter().map(|t| poses[*t][joint][k]).sum::<f64>() / seen.len() as f64)
            };
            let (made, real) = (mean(&pair.made), mean(&pair.real));
            for &t in &seen {
                let sums = &mut blocks.at(t)[3 * i..3 * i + 3];
                let apart = |x: Point, mean: Point| (0..3).map(|k| (x[k] - mean[k]).abs()).sum::<f64>();
                sums[0] += apart(pair.made[t][joint], made);
                sums[1] += apart(pair.real[t][joint], real);
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
