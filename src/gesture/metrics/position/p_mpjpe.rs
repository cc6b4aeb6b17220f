//! Procrustes-aligned position error (P-MPJPE): the error after the best rotation, scale and translation of the
//! predicted pose of every frame, which measures the pose itself regardless of its orientation.

use crate::metrics::body_part::BodyPart;
use crate::metrics::definition::{Better, Definition, MetricFamily};
use orator_base::math::procrustes::similarity;
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::skeleton::{L_HAND, N_HAND_JOINTS, R_HAND};
use serde_json::json;

/// P-MPJPE of all joints, the body, or the hands, of which each (21 joints) is aligned separately.
pub(crate) fn metric(part: BodyPart) -> MetricFamily {
    // Groups of joints that are aligned together.
    let groups: Vec<Vec<usize>> = match part {
        BodyPart::Hands => [L_HAND, R_HAND].map(|root| (root..root + N_HAND_JOINTS).collect()).to_vec(),
        _ => vec![part.joints()],
    };
    let definition = Definition {
        formula: "1000 times the mean over t and j of |S_t p - g|, S_t the turn, uniform scale and shift without \
                  reflection that bring the seen joints of the part in frame t nearest to those of g (least \
                  squares); part hands: each hand for itself, all its 21 joints, the wrist among them",
        undefined: "no frame has 3 visible joints of the part",
        parameters: json!({"scale": true, "reflection": false}),
        ..Definition::new("p_mpjpe", part.name(), "mm", Better::Lower)
    };
    MetricFamily::mean(definition, move |pair, blocks| {
        for t in 0..pair.n_frames() {
            for group in &groups {
                let visible = group.iter().copied().filter(|joint| pair.visible[t][*joint]);
                let (predicted, ground_truth): (Vec<Vec3>, Vec<Vec3>) =
                    visible.map(|joint| (pair.predicted[t][joint], pair.ground_truth[t][joint])).unzip();
                if predicted.len() >= 3 {
                    let sums = blocks.at(t);
                    sums[0] += 1000.0 * error(&predicted, &ground_truth);
                    sums[1] += predicted.len() as f64;
                }
            }
        }
    })
}

/// Sum of the distances after the best similarity transform; NaN if a predicted point is not finite.
fn error(predicted: &[Vec3], ground_truth: &[Vec3]) -> f64 {
    if predicted.iter().flatten().any(|v| !v.is_finite()) {
        return f64::NAN;
    }
    match similarity(predicted, ground_truth) {
        Some(best) => predicted.iter().zip(ground_truth).map(|(p, g)| vec3::norm(vec3::sub(best.apply(*p), *g))).sum(),
        // If all predicted points coincide, they are aligned to the centroid of the ground truth.
        None => {
            let n = ground_truth.len() as f64;
            let centroid: Vec3 = std::array::from_fn(|k| ground_truth.iter().map(|g| g[k]).sum::<f64>() / n);
            ground_truth.iter().map(|g| vec3::norm(vec3::sub(centroid, *g))).sum()
        }
    }
}
