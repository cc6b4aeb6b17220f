//! How far apart the distributions of speeds are: Hellinger distance of two histograms, 0 the same, 1 nothing in common.

use crate::math::vec3;
use crate::math::vec3::Vec3;
use crate::metrics::body_part::BodyPart;
use crate::metrics::definition::{Better, Definition, MetricFamily};
use crate::metrics::pair::PairedFrames;
use crate::metrics::sums::BlockSums;
use crate::types::skeleton::N_JOINTS;
use serde_json::json;

struct Hellinger {
    part: &'static str,
    joints: Vec<usize>,
    /// Metres a second.
    bin: f64,
    n_bins: usize,
    genea: bool,
}

/// Bins of 0.05 m/s up to 6 m/s.
pub(crate) fn metric(part: BodyPart) -> Box<dyn MetricFamily> {
    Box::new(Hellinger { part: part.name(), joints: part.joints(), bin: 0.05, n_bins: 120, genea: false })
}

/// Histograms of the GENEA evaluation, at the bins of its script for the distance (0.05 cm/s).
pub(crate) fn genea() -> Box<dyn MetricFamily> {
    let joints = (GENEA_FIRST..N_JOINTS).collect();
    Box::new(Hellinger { part: "from_joint_8", joints, bin: 0.0005, n_bins: 980, genea: true })
}

/// The first of the joints that `[:, 8:]` leaves of 49.
const GENEA_FIRST: usize = 8;

impl MetricFamily for Hellinger {
    fn definitions(&self) -> Vec<Definition> {
        let parameters = match self.genea {
            true => json!({"bin_cm_per_s": 0.05, "first_joint": GENEA_FIRST}),
            false => json!({"bin_m_per_s": self.bin, "n_bins": self.n_bins}),
        };
        vec![Definition {
            name: "hellinger_speed",
            part: self.part,
            unit: "1",
            better: Better::Lower,
            formula: match self.genea {
                true => {
                    "sqrt(1 - sum over bins of sqrt(h_p h_g)), h the shares of speeds |x(t+1) - x(t)| * fps of all \
                     joints in bins of arange(0, 49 + width, width) cm/s; speeds of 49 cm/s and more are dropped, the \
                     first 8 joints too ([:, 8:])"
                }
                false => {
                    "sqrt(1 - sum over bins of sqrt(h_p h_g)), h the shares of speeds |x(t+1) - x(t)| * fps over t and \
                     j in equal bins from 0, x seen in both frames; speeds beyond the last bin are dropped"
                }
            },
            undefined: "no joint of the part is seen in 2 frames in a row, or all speeds are beyond the last bin",
            parameters,
        }]
    }

    fn n_sums(&self) -> usize {
        2 * self.n_bins
    }

    fn measure(&self, pair: &PairedFrames, blocks: &mut BlockSums) {
        for t in 0..pair.n_frames().saturating_sub(1) {
            let sums = blocks.at(t);
            for &joint in self.joints.iter().filter(|joint| pair.sees(t, 2, **joint)) {
                let mut count = |poses: &[[Vec3; N_JOINTS]], from: usize| {
                    let speed = vec3::norm(vec3::sub(poses[t + 1][joint], poses[t][joint])) * pair.fps;
                    match (speed / self.bin).floor() {
                        bin if bin < self.n_bins as f64 => sums[from + bin as usize] += 1.0,
                        // a predicted joint that is not finite: no distance
                        bin if bin.is_nan() => sums[from] = f64::NAN,
                        _ => {}
                    }
                };
                count(&pair.predicted, 0);
                count(&pair.ground_truth, self.n_bins);
            }
        }
    }

    fn values(&self, sums: &[f64]) -> Vec<f64> {
        let (predicted, ground_truth) = sums.split_at(self.n_bins);
        vec![distance(predicted, ground_truth)]
    }
}

/// Of two histograms of counts; NaN where one is empty.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let both = a.iter().sum::<f64>() * b.iter().sum::<f64>();
    let overlap = a.iter().zip(b).map(|(a, b)| (a * b).sqrt()).sum::<f64>() / both.sqrt();
    // rounding may leave it above 1
    if overlap.is_nan() { f64::NAN } else { (1.0 - overlap).max(0.0).sqrt() }
}
