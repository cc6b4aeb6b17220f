//! Hellinger distance between the histograms of predicted and real speeds: 0 for equal histograms, 1 for disjoint ones.

use crate::metrics::definition::{Better, BodyPart, Definition, MetricFamily};
use crate::metrics::pair::PairedFrames;
use crate::metrics::sums::BlockSums;
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::skeleton::N_JOINTS;
use serde_json::{Value, json};

/// First of the 49 joints that remains after `[:, 8:]` in the GENEA script.
const GENEA_FIRST: usize = 8;
/// Width of a bin, m/s.
const GENEA_BIN: f64 = 0.0005;
const GENEA_BINS: usize = 980;

/// Metric with bins of 0.05 m/s up to 6 m/s.
pub(crate) fn metric(part: BodyPart) -> MetricFamily {
    let (bin, n_bins) = (0.05, 120);
    let formula = "sqrt(1 - sum over bins of sqrt(h_p h_g)), h the shares of speeds |x(t+1) - x(t)| * fps over t and \
                   j in equal bins from 0, x seen in both frames; speeds beyond the last bin are dropped";
    family((part.name(), part.joints()), bin, n_bins, formula, json!({"bin_m_per_s": bin, "n_bins": n_bins}))
}

/// Metric of the GENEA evaluation with the bins of its script (0.05 cm/s). Its selection of joints excludes the arms,
/// so that the arms are used instead if there are no fingers.
pub(crate) fn genea(has_fingers: bool) -> MetricFamily {
    if !has_fingers {
        let formula = "sqrt(1 - sum over bins of sqrt(h_p h_g)), h the shares of speeds |x(t+1) - x(t)| * fps of the \
                       joints of the arms in bins of arange(0, 49 + width, width) cm/s; speeds of 49 cm/s and more are \
                       dropped; the published [:, 8:] would leave fingers alone, of which none is seen";
        let part = (BodyPart::Body.name(), BodyPart::Body.joints());
        return family(part, GENEA_BIN, GENEA_BINS, formula, json!({"bin_cm_per_s": 0.05}));
    }
    let formula = "sqrt(1 - sum over bins of sqrt(h_p h_g)), h the shares of speeds |x(t+1) - x(t)| * fps of all \
                   joints in bins of arange(0, 49 + width, width) cm/s; speeds of 49 cm/s and more are dropped, the \
                   first 8 joints too ([:, 8:])";
    let parameters = json!({"bin_cm_per_s": 0.05, "first_joint": GENEA_FIRST});
    family(("from_joint_8", (GENEA_FIRST..N_JOINTS).collect()), GENEA_BIN, GENEA_BINS, formula, parameters)
}

/// Metric of the joints of a named part; `bin` is in m/s.
fn family(
    (part, joints): (&'static str, Vec<usize>),
    bin: f64,
    n_bins: usize,
    formula: &'static str,
    parameters: Value,
) -> MetricFamily {
    let definition = Definition {
        formula,
        undefined: "no joint of the part is visible in 2 frames in a row, or all speeds are beyond the last bin",
        parameters,
        ..Definition::new("hellinger_speed", part, "1", Better::Lower)
    };
    let measure = move |pair: &PairedFrames, blocks: &mut BlockSums| {
        for t in 0..pair.n_frames().saturating_sub(1) {
            let sums = blocks.at(t);
            for &joint in joints.iter().filter(|joint| pair.is_visible(t, 2, **joint)) {
                let mut count = |poses: &[[Vec3; N_JOINTS]], from: usize| {
                    let speed = vec3::norm(vec3::sub(poses[t + 1][joint], poses[t][joint])) * pair.fps;
                    match (speed / bin).floor() {
                        at if at < n_bins as f64 => sums[from + at as usize] += 1.0,
                        // A predicted joint that is not finite makes the distance undefined.
                        at if at.is_nan() => sums[from] = f64::NAN,
                        _ => {}
                    }
                };
                count(&pair.predicted, 0);
                count(&pair.ground_truth, n_bins);
            }
        }
    };
    let values = move |sums: &[f64]| {
        let (predicted, ground_truth) = sums.split_at(n_bins);
        vec![distance(predicted, ground_truth)]
    };
    MetricFamily::new(vec![definition], 2 * n_bins, measure, values)
}

/// Hellinger distance of two histograms of counts; NaN if one is empty.
pub(crate) fn distance(a: &[f64], b: &[f64]) -> f64 {
    let both = a.iter().sum::<f64>() * b.iter().sum::<f64>();
    let overlap = a.iter().zip(b).map(|(a, b)| (a * b).sqrt()).sum::<f64>() / both.sqrt();
    // Rounding errors may make the overlap larger than 1.
    if overlap.is_nan() { f64::NAN } else { (1.0 - overlap).max(0.0).sqrt() }
}
