//! Beat consistency: whether motion has beats at the onsets of the sound. The metric of the emage convention (Liu et
//! al. 2024), and a simpler one of this project.

use crate::metrics::definition::{Better, BodyPart, Definition, MetricFamily};
use crate::metrics::pair::PairedFrames;
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::skeleton::{L_ELBOW, L_WRIST, N_JOINTS, R_ELBOW, R_WRIST};
use serde_json::json;

/// Indices of the strict local minima, which are lower than `order` neighbours on either side (fewer at the borders,
/// but never the first or last), as in scipy's `argrelextrema(np.less)`. No value is lower than NaN.
pub fn minima(values: &[f64], order: usize) -> Vec<usize> {
    let is_lowest = |i: &usize| {
        let last = values.len() - 1;
        (1..=order).all(|k| values[*i] < values[i.saturating_sub(k)] && values[*i] < values[(i + k).min(last)])
    };
    (0..values.len()).filter(is_lowest).collect()
}

/// `exp(-d^2 / 2 sigma^2)` with the distance d to the nearest of the sorted `times`; 0 if there are none.
pub(crate) fn beat_proximity(time: f64, times: &[f64], sigma: f64) -> f64 {
    let after = times.partition_point(|other| *other < time);
    let neighbours = times.iter().skip(after.saturating_sub(1)).take(2);
    let nearest = neighbours.map(|other| (other - time).abs()).fold(f64::INFINITY, f64::min);
    (-nearest * nearest / (2.0 * sigma * sigma)).exp()
}

/// Speeds in m/s by central differences (one-sided at both ends); NaN where a frame is missing.
fn speeds(track: &[Vec3], fps: f64) -> Vec<f64> {
    let at = |t: usize| {
        let (before, after) = (t.saturating_sub(1), (t + 1).min(track.len() - 1));
        vec3::norm(vec3::sub(track[after], track[before])) * fps / (after - before).max(1) as f64
    };
    (0..track.len()).map(at).collect()
}

/// Positions of a joint, NaN where it is not visible.
fn track(pair: &PairedFrames, poses: &[[Vec3; N_JOINTS]], joint: usize) -> Vec<Vec3> {
    poses
        .iter()
        .zip(&pair.visible)
        .map(|(pose, visible)| if visible[joint] { pose[joint] } else { [f64::NAN; 3] })
        .collect()
}

const OF_REAL: &str = "beat_consistency_of_real";
/// Joints whose beats are measured.
const JOINTS: [usize; 4] = [R_ELBOW, R_WRIST, L_ELBOW, L_WRIST];
/// Width of the Gaussian kernel of the time between beat and onset, seconds.
const SIGMA: f64 = 0.1;
/// Number of faster frames on either side of a beat, at `ORDER_FPS`.
const ORDER: f64 = 7.0;
const ORDER_FPS: f64 = 30.0;

/// Beat consistency of this project, for data at `fps`.
pub(crate) fn metric(fps: f64) -> MetricFamily {
    let order = order(fps);
    let definition = Definition {
        formula: "mean over the onsets of the sound and over the joints of exp(-d^2 / 2 sigma^2), d the time to the nearest \
                  beat of the joint: a strict local minimum, among `order` frames on either side, of its speed by \
                  central differences; 0 where a joint has no beat in the interval; onsets where the joint is not \
                  seen left out. Onsets: spectral flux, `audio::onset`",
        undefined: "there is no audio, no onset in it, or no elbow or wrist is visible at one",
        parameters: json!({"joints": JOINTS, "sigma_secs": SIGMA, "order_frames": order}),
        ..Definition::new("beat_consistency", "arms", "1", Better::NearerTruth)
    };
    MetricFamily::mean_of_both(definition.with_truth(OF_REAL), move |pair, blocks| {
        let Some(onsets) = pair.interval.onsets else { return };
        for joint in JOINTS {
            let [predicted, ground_truth] = [&pair.predicted, &pair.ground_truth].map(|poses| {
                let beats = minima(&speeds(&track(pair, poses, joint), pair.fps), order);
                beats.into_iter().map(|t| t as f64 / pair.fps).collect::<Vec<_>>()
            });
            for &onset in onsets {
                let t = (onset * pair.fps) as usize;
                if pair.is_visible(t, 1, joint) {
                    let sums = blocks.at(t);
                    let is_non_finite = pair.predicted[t][joint].iter().any(|v| !v.is_finite());
                    sums[0] += if is_non_finite { f64::NAN } else { beat_proximity(onset, &predicted, SIGMA) };
                    sums[1] += beat_proximity(onset, &ground_truth, SIGMA);
                    sums[2] += 1.0;
                }
            }
        }
    })
}

fn order(fps: f64) -> usize {
    ((ORDER / ORDER_FPS * fps).round() as usize).max(1)
}

const EMAGE_SIGMA: f64 = 0.3;
const EMAGE_THRESHOLD: f64 = 0.3;
/// Duration that is excluded at both ends, seconds.
const EMAGE_CUT: f64 = 2.0;

/// Beat consistency of the emage convention, for data at `fps`.
pub(crate) fn emage(fps: f64) -> MetricFamily {
    let (order, cut) = (order(fps), (EMAGE_CUT * fps).round() as usize);
    let definition = Definition {
        formula: "per interval the mean over joints 1-6 and over onsets of exp(-d^2 / 2 sigma^2), d to the nearest beat \
                  of the joint; intervals weigh by their frames without the cut. Beats: strict local minima of speed \
                  (central differences) / the joint's mean speed in the real interval (theirs: of their dataset), \
                  among `order` frames on either side, with speed / mean above the threshold, looked up `cut` frames \
                  early; positions first replaced by |x - mean| by coordinate; first and last 2 s of motion and \
                  onsets left out (theirs finds onsets in the sound thus cut)",
        undefined: "no interval has an onset and a visible joint further than 2 s from both its ends",
        parameters: json!({
            "joints": BodyPart::Body.joints(), "sigma_secs": EMAGE_SIGMA, "order_frames": order,
            "threshold": EMAGE_THRESHOLD, "cut_frames": cut,
        }),
        ..Definition::new("beat_consistency", BodyPart::Body.name(), "1", Better::NearerTruth)
    };
    MetricFamily::mean_of_both(definition.with_truth(OF_REAL), move |pair, blocks| {
        let Some(onsets) = pair.interval.onsets else { return };
        let n_inner = pair.n_frames().saturating_sub(2 * cut);
        let (from, to) = (cut as f64 / pair.fps, (cut + n_inner) as f64 / pair.fps);
        let inner: Vec<f64> = onsets.iter().copied().filter(|onset| (from..to).contains(onset)).collect();
        for joint in BodyPart::Body.joints() {
            let ground_truth = track(pair, &pair.ground_truth, joint);
            let real: Vec<f64> =
                speeds(&ground_truth, pair.fps).into_iter().filter(|speed| speed.is_finite()).collect();
            if real.is_empty() {
                continue;
            }
            let mean_speed = real.iter().sum::<f64>() / real.len() as f64;
            // Times of the beats relative to the cut.
            let beats = |positions: &[Vec3]| -> Vec<f64> {
                let speeds = speeds(&abs_deviations(positions), pair.fps);
                let speeds: Vec<f64> = speeds.iter().map(|speed| speed / mean_speed).collect();
                let inner = speeds.get(cut..speeds.len().saturating_sub(cut)).unwrap_or_default();
                // As in the original code, the threshold is applied at the index within the cut, which is 2 s early.
                let beats = minima(inner, order).into_iter().filter(|t| speeds[*t] > EMAGE_THRESHOLD);
                beats.map(|t| t as f64 / pair.fps).collect()
            };
            let (predicted, ground_truth) = (beats(&track(pair, &pair.predicted, joint)), beats(&ground_truth));
            let is_non_finite =
                (0..pair.n_frames()).any(|t| pair.visible[t][joint] && !pair.predicted[t][joint][0].is_finite());
            let weight = n_inner as f64 / inner.len() as f64;
            for onset in &inner {
                let sums = blocks.at((onset * pair.fps) as usize);
                let time = onset - from;
                sums[0] +=
                    if is_non_finite { f64::NAN } else { weight * beat_proximity(time, &predicted, EMAGE_SIGMA) };
                sums[1] += weight * beat_proximity(time, &ground_truth, EMAGE_SIGMA);
                sums[2] += weight;
            }
        }
    })
}

/// Absolute deviations from the mean by coordinate. The original code computes L1div in place, and searches the
/// modified array for beats.
fn abs_deviations(positions: &[Vec3]) -> Vec<Vec3> {
    let visible: Vec<&Vec3> = positions.iter().filter(|p| p.iter().all(|v| v.is_finite())).collect();
    let mean: Vec3 = std::array::from_fn(|k| visible.iter().map(|p| p[k]).sum::<f64>() / visible.len() as f64);
    positions.iter().map(|p| std::array::from_fn(|k| (p[k] - mean[k]).abs())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn minima_match_scipy() {
        let golden: serde_json::Value =
            serde_json::from_str(include_str!("../../../../fixtures/reference/metrics_golden.json")).unwrap();
        let values: Vec<f64> = serde_json::from_value(golden["minima"]["values"].clone()).unwrap();
        for (order, expected) in golden["minima"]["of_order"].as_object().unwrap() {
            let expected: Vec<usize> = serde_json::from_value(expected.clone()).unwrap();
            assert_eq!(minima(&values, order.parse().unwrap()), expected, "order {order}");
        }
        assert!(minima(&[], 3).is_empty());
        assert!(minima(&[f64::NAN, 1.0, f64::NAN], 1).is_empty());
    }

    #[test]
    fn nearness_is_a_gaussian_of_the_distance() {
        assert_eq!(beat_proximity(1.0, &[1.0, 3.0], 0.1), 1.0);
        assert!((beat_proximity(1.0, &[1.1], 0.1) - (-0.5f64).exp()).abs() < 1e-9);
        assert_eq!(beat_proximity(1.0, &[], 0.1), 0.0);
    }
}
