//! Position error after the best turn, scale and shift of every frame's made pose: what is wrong with the pose itself,
//! not with where it looks.

use crate::math::procrustes::similarity;
use crate::metrics::body_part::Part;
use crate::metrics::definition::{Better, Definition, Metric};
use crate::metrics::pair::{Pair, Point};
use crate::metrics::per_frame::{less, norm};
use crate::metrics::sums::Blocks;
use crate::types::skeleton::{L_HAND, N_HAND_JOINTS, R_HAND};
use serde_json::json;

struct PMpjpe {
    part: Part,
    /// What is laid onto the real joints together.
    groups: Vec<Vec<usize>>,
}

/// All, body, or each hand (its 21 joints) for itself.
pub(crate) fn metric(part: Part) -> Box<dyn Metric> {
    let groups = match part {
        Part::Hands => [L_HAND, R_HAND].map(|root| (root..root + N_HAND_JOINTS).collect()).to_vec(),
        _ => vec![part.joints()],
    };
    Box::new(PMpjpe { part, groups })
}

impl Metric for PMpjpe {
    fn definitions(&self) -> Vec<Definition> {
        vec![Definition {
            name: "p_mpjpe",
            part: self.part.name(),
            unit: "mm",
            better: Better::Lower,
            formula: "1000 times the mean over t and j of |S_t p - g|, S_t the turn, uniform scale and shift without \
                      reflection that bring the seen joints of the part in frame t nearest to those of g (least \
                      squares); part hands: each hand for itself, all its 21 joints, the wrist among them",
            undefined: "no frame has 3 seen joints of the part",
            parameters: json!({"scale": true, "reflection": false}),
        }]
    }

    fn n_sums(&self) -> usize {
        2
    }

    fn measure(&self, pair: &Pair, blocks: &mut Blocks) {
        for t in 0..pair.n_frames() {
            for group in &self.groups {
                let seen = group.iter().copied().filter(|joint| pair.seen[t][*joint]);
                let (made, real): (Vec<Point>, Vec<Point>) =
                    seen.map(|joint| (pair.made[t][joint], pair.real[t][joint])).unzip();
                if made.len() >= 3 {
                    let sums = blocks.at(t);
                    sums[0] += 1000.0 * error(&made, &real);
                    sums[1] += made.len() as f64;
                }
            }
        }
    }

    fn values(&self, sums: &[f64]) -> Vec<f64> {
        vec![sums[0] / sums[1]]
    }
}

/// Sum of the distances after the best similarity; NaN where a made point is not finite.
fn error(made: &[Point], real: &[Point]) -> f64 {
    if made.iter().flatten().any(|v| !v.is_finite()) {
        return f64::NAN;
    }
    match similarity(made, real) {
        Some(best) => made.iter().zip(real).map(|(p, g)| norm(less(best.apply(*p), *g))).sum(),
        // all made points in one place: the best is the middle of the real ones
        None => {
            let n = real.len() as f64;
            let middle: Point = std::array::from_fn(|k| real.iter().map(|g| g[k]).sum::<f64>() / n);
            real.iter().map(|g| norm(less(middle, *g))).sum()
        }
    }
}
