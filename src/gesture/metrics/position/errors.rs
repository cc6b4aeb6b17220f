//! Position and acceleration errors, averaged over points and windows of one or three frames, including the two of the
//! trimodal convention (Yoon et al. 2020, `train.py` in their repository), and the error after Procrustes alignment
//! (P-MPJPE), which measures the pose itself regardless of its orientation.

use crate::metrics::definition::{Better, BodyPart, Definition, MetricFamily};
use crate::metrics::pair::{self, PointWindow};
use orator_base::math::procrustes::similarity;
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::skeleton::{L_HAND, N_HAND_JOINTS, R_HAND};
use serde_json::json;

/// Mean absolute error of the coordinates, metres, as in the L1 loss of training.
pub(crate) fn l1(part: BodyPart) -> MetricFamily {
    let definition = Definition {
        formula: "mean over t, j and the coordinates x, y, z of |p - g|",
        undefined: "no joint of the part is visible",
        ..Definition::new("l1", part.name(), "m", Better::Lower)
    };
    pair::mean(definition, part, 1, 0, |window| mean_abs(window.difference(0)))
}

/// Mean per-joint position error (MPJPE), millimetres, relative to the neck or to the wrist of the same side.
pub(crate) fn mpjpe(part: BodyPart) -> MetricFamily {
    let definition = Definition {
        formula: "1000 times the mean over t and j of the distance |p - g|, positions from the neck (part \
                  fingers_from_wrist: from the wrist of the same side)",
        undefined: "no joint of the part is visible",
        ..Definition::new("mpjpe", part.name(), "mm", Better::Lower)
    };
    pair::mean(definition, part, 1, 0, |window| 1000.0 * vec3::norm(window.difference(0)))
}

/// Mean norm of the difference between predicted and real accelerations.
pub(crate) fn acceleration(part: BodyPart) -> MetricFamily {
    let definition = Definition {
        formula: "mean over t and j of |a_p - a_g| with a(t) = (x(t) - 2 x(t+1) + x(t+2)) * fps^2, where the joint is seen \
                  in all three frames",
        undefined: "no joint of the part is visible in 3 frames in a row",
        ..Definition::new("acceleration_error", part.name(), "m/s^2", Better::Lower)
    };
    let of = |window: &PointWindow| vec3::norm(second_difference(window)) * window.fps() * window.fps();
    pair::mean(definition, part, 3, 0, of)
}

/// Acceleration error of the trimodal convention: mean over coordinates, in units per frame^2.
pub(crate) fn acceleration_by_coordinate() -> MetricFamily {
    let definition = Definition {
        formula: "mean over t, j and the coordinates x, y, z of |d2 p - d2 g|, d2 the second difference from frame to frame, \
                  not multiplied with the frame rate (so another figure at another rate)",
        undefined: "no joint is visible in 3 frames in a row",
        ..Definition::new("acceleration_error", BodyPart::All.name(), "m/frame^2", Better::Lower)
    };
    pair::mean(definition, BodyPart::All, 3, 0, |window| mean_abs(second_difference(window)))
}

/// Number of seed frames given to the generator in the trimodal convention, at `SEED_FPS`.
const N_SEED: f64 = 4.0;
const SEED_FPS: f64 = 15.0;

/// Mean absolute joint error (MAJE) of the trimodal convention: L1 without the seed frames, for data at `fps`.
pub(crate) fn maje(fps: f64) -> MetricFamily {
    let n_seed = (N_SEED / SEED_FPS * fps).round() as usize;
    let definition = Definition {
        formula: "mean over t, j and the coordinates x, y, z of |p - g| without the first frames of every interval, \
                  which their generator is given (4 at 15 frames a second)",
        undefined: "no joint is visible after the seed frames",
        parameters: json!({"n_seed_frames": n_seed}),
        ..Definition::new("maje", BodyPart::All.name(), "m", Better::Lower)
    };
    pair::mean(definition, BodyPart::All, 1, n_seed, |window| mean_abs(window.difference(0)))
}

/// Mean absolute value of the coordinates.
fn mean_abs(v: Vec3) -> f64 {
    v.iter().map(|v| v.abs()).sum::<f64>() / 3.0
}

/// Second difference of prediction minus ground truth over three frames.
fn second_difference(window: &PointWindow) -> Vec3 {
    let [a, b, c] = [0, 1, 2].map(|k| window.difference(k));
    std::array::from_fn(|k| a[k] - 2.0 * b[k] + c[k])
}

/// P-MPJPE of all joints, of the body, or of the hands. The two hands, of 21 joints each, are aligned separately.
pub(crate) fn p_mpjpe(part: BodyPart) -> MetricFamily {
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
