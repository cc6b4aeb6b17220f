//! How far the accelerations of the predicted motion are from the ground truth; and the two errors of the trimodal convention,
//! which has its own (Yoon et al. 2020, `train.py` of their repository).

use crate::math::vec3;
use crate::math::vec3::Vec3;
use crate::metrics::body_part::BodyPart;
use crate::metrics::definition::{Better, Definition, MetricFamily};
use crate::metrics::pair::PairedFrames;
use crate::metrics::per_frame::{FrameMean, PointWindow};
use crate::metrics::sums::BlockSums;
use serde_json::json;

pub(crate) fn metric(part: BodyPart) -> Box<dyn MetricFamily> {
    let definition = Definition {
        name: "acceleration_error",
        part: part.name(),
        unit: "m/s^2",
        better: Better::Lower,
        formula: "mean over t and j of |a_p - a_g| with a(t) = (x(t) - 2 x(t+1) + x(t+2)) * fps^2, where the joint is seen \
                  in all three frames",
        undefined: "no joint of the part is seen in 3 frames in a row",
        parameters: json!({}),
    };
    FrameMean::over(definition, part, 3, |window| vec3::norm(second_difference(window)) * window.fps * window.fps)
}

/// Second difference of prediction minus ground truth over three frames.
fn second_difference(window: &PointWindow) -> Vec3 {
    let [a, b, c] = [0, 1, 2].map(|k| window.apart(k));
    std::array::from_fn(|k| a[k] - 2.0 * b[k] + c[k])
}

/// Trimodal: per coordinate and frame.
pub(crate) fn by_coordinate() -> Box<dyn MetricFamily> {
    let definition = Definition {
        name: "acceleration_error",
        part: BodyPart::All.name(),
        unit: "m/frame^2",
        better: Better::Lower,
        formula: "mean over t, j and the coordinates x, y, z of |d2 p - d2 g|, d2 the second difference from frame to frame, \
                  not multiplied with the frame rate (so another figure at another rate)",
        undefined: "no joint is seen in 3 frames in a row",
        parameters: json!({}),
    };
    FrameMean::over(definition, BodyPart::All, 3, |window| {
        second_difference(window).iter().map(|v| v.abs()).sum::<f64>() / 3.0
    })
}

/// Frames given as a seed, of the trimodal convention's 15 a second.
const N_SEED: f64 = 4.0;
const SEED_FPS: f64 = 15.0;

/// Trimodal: L1 without the seed.
struct Maje {
    n_seed: usize,
}

/// For data of this frame rate.
pub(crate) fn maje(fps: f64) -> Box<dyn MetricFamily> {
    Box::new(Maje { n_seed: (N_SEED / SEED_FPS * fps).round() as usize })
}

impl MetricFamily for Maje {
    fn definitions(&self) -> Vec<Definition> {
        vec![Definition {
            name: "maje",
            part: BodyPart::All.name(),
            unit: "m",
            better: Better::Lower,
            formula: "mean over t, j and the coordinates x, y, z of |p - g| without the first frames of every interval, \
                      which their generator is given (4 at 15 frames a second)",
            undefined: "no joint is seen after the seed",
            parameters: json!({"n_seed_frames": self.n_seed}),
        }]
    }

    fn n_sums(&self) -> usize {
        2
    }

    fn measure(&self, pair: &PairedFrames, blocks: &mut BlockSums) {
        for t in self.n_seed..pair.n_frames() {
            let sums = blocks.at(t);
            for joint in BodyPart::All.joints().into_iter().filter(|joint| pair.seen[t][*joint]) {
                sums[0] +=
                    (0..3).map(|k| (pair.predicted[t][joint][k] - pair.ground_truth[t][joint][k]).abs()).sum::<f64>()
                        / 3.0;
                sums[1] += 1.0;
            }
        }
    }

    fn values(&self, sums: &[f64]) -> Vec<f64> {
        vec![sums[0] / sums[1]]
    }
}
