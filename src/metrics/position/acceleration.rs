//! How far the accelerations of the made motion are from the real ones; and the two errors of the trimodal convention,
//! which has its own (Yoon et al. 2020, `train.py` of their repository).

use crate::metrics::body_part::Part;
use crate::metrics::definition::{Better, Definition, Metric};
use crate::metrics::pair::{Pair, Point};
use crate::metrics::per_frame::{Mean, Window, norm};
use crate::metrics::sums::Blocks;
use serde_json::json;

pub(crate) fn metric(part: Part) -> Box<dyn Metric> {
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
    Mean::over(definition, part, 3, |window| norm(second_difference(window)) * window.fps * window.fps)
}

/// Of made less real.
fn second_difference(window: &Window) -> Point {
    let [a, b, c] = [0, 1, 2].map(|k| window.apart(k));
    std::array::from_fn(|k| a[k] - 2.0 * b[k] + c[k])
}

/// Trimodal: per coordinate and frame.
pub(crate) fn by_coordinate() -> Box<dyn Metric> {
    let definition = Definition {
        name: "acceleration_error",
        part: Part::All.name(),
        unit: "m/frame^2",
        better: Better::Lower,
        formula: "mean over t, j and the coordinates x, y, z of |d2 p - d2 g|, d2 the second difference from frame to frame, \
                  not multiplied with the frame rate (so another figure at another rate)",
        undefined: "no joint is seen in 3 frames in a row",
        parameters: json!({}),
    };
    Mean::over(definition, Part::All, 3, |window| second_difference(window).iter().map(|v| v.abs()).sum::<f64>() / 3.0)
}

/// Frames given as a seed, of the trimodal convention's 15 a second.
const N_SEED: f64 = 4.0;
const SEED_FPS: f64 = 15.0;

/// Trimodal: L1 without the seed.
struct Maje {
    n_seed: usize,
}

/// For data of this frame rate.
pub(crate) fn maje(fps: f64) -> Box<dyn Metric> {
    Box::new(Maje { n_seed: (N_SEED / SEED_FPS * fps).round() as usize })
}

impl Metric for Maje {
    fn definitions(&self) -> Vec<Definition> {
        vec![Definition {
            name: "maje",
            part: Part::All.name(),
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

    fn measure(&self, pair: &Pair, blocks: &mut Blocks) {
        for t in self.n_seed..pair.n_frames() {
            let sums = blocks.at(t);
            for joint in Part::All.joints().into_iter().filter(|joint| pair.seen[t][*joint]) {
                sums[0] += (0..3).map(|k| (pair.made[t][joint][k] - pair.real[t][joint][k]).abs()).sum::<f64>() / 3.0;
                sums[1] += 1.0;
            }
        }
    }

    fn values(&self, sums: &[f64]) -> Vec<f64> {
        vec![sums[0] / sums[1]]
    }
}
