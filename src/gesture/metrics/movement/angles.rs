//! Metrics of head and trunk angles: errors, speeds, correlations. The angles follow the joints of a motion as rows 49
//! (head) and 50 (trunk): yaw, pitch, roll in radians; NaN where they are not visible.

use crate::metrics::definition::{Better, Definition, MetricFamily};
use crate::metrics::movement::hellinger;
use crate::metrics::pair::{MotionPair, PairedFrames};
use orator_base::types::posture::PostureChannel;
use orator_base::types::skeleton::N_JOINTS;
use serde_json::json;

/// Width of the bins of angular speed, degrees per second.
const BIN: f64 = 5.0;
const N_BINS: usize = 72;
/// Smallest variance of an angle that counts as moving, square degrees.
const MIN_VARIANCE: f64 = 1e-6;

/// Predicted and true angle `k` of frame `t` in degrees; `None` if one is missing.
fn both(pair: &MotionPair, t: usize, row: usize, k: usize) -> Option<[f64; 2]> {
    let angles = [pair.predicted, pair.ground_truth]
        .map(|motion| motion.get([t, row, k]).map_or(f64::NAN, |angle| f64::from(*angle).to_degrees()));
    angles.iter().all(|angle| angle.is_finite()).then_some(angles)
}

/// Predicted and true angular speed from frame `t` to the next, degrees per second, over the angles that are present.
fn speeds(pair: &MotionPair, t: usize, row: usize) -> Option<[f64; 2]> {
    let turns = (0..3).filter_map(|k| {
        let (now, next) = (both(pair, t, row, k)?, both(pair, t + 1, row, k)?);
        Some([0, 1].map(|of| turn(next[of] - now[of])))
    });
    let turns: Vec<[f64; 2]> = turns.collect();
    let speed = |of: usize| turns.iter().map(|turn| turn[of].powi(2)).sum::<f64>().sqrt() * pair.fps.per_sec();
    (!turns.is_empty()).then(|| [speed(0), speed(1)])
}

/// Angle in degrees, wrapped to the range -180 to 180.
fn turn(degrees: f64) -> f64 {
    degrees - 360.0 * (degrees / 360.0).round()
}

pub(crate) fn metrics(channel: PostureChannel) -> [MetricFamily; 4] {
    let row = N_JOINTS + usize::from(channel == PostureChannel::Trunk);
    let definition = |name, unit, better, formula, undefined| Definition {
        formula,
        undefined,
        ..Definition::new(name, channel.name(), unit, better)
    };
    let unseen = "its angles are not predicted, or not visible";
    let error = definition(
        "angle_error",
        "degrees",
        Better::Lower,
        "mean over t and the angles yaw, pitch, roll of |p - g|, the shorter way round",
        unseen,
    );
    let speed = definition(
        "angular_speed",
        "degrees/s",
        Better::NearerTruth,
        "mean over t of |x(t+1) - x(t)| * fps, x the vector of yaw, pitch and roll",
        unseen,
    );
    let mut hellinger = definition(
        "hellinger_angular_speed",
        "1",
        Better::Lower,
        "sqrt(1 - sum over bins of sqrt(h_p h_g)), h the shares of angular speeds in equal bins from 0; speeds beyond the last bin \
         are dropped",
        unseen,
    );
    hellinger.parameters = json!({"bin_degrees_per_s": BIN, "n_bins": N_BINS});
    let correlation = definition(
        "angle_correlation",
        "1",
        Better::Higher,
        "mean of the correlations over t of p and g of those of yaw, pitch and roll that move in both",
        "its angles are not predicted, not visible, or constant",
    );
    [
        MetricFamily::mean(error, move |pair, blocks| {
            for (t, k) in angles(pair) {
                if let Some([p, g]) = both(&pair.interval, t, row, k) {
                    let sums = blocks.at(t);
                    (sums[0], sums[1]) = (sums[0] + turn(p - g).abs(), sums[1] + 1.0);
                }
            }
        }),
        MetricFamily::mean_of_both(speed.with_truth("angular_speed_of_real"), move |pair, blocks| {
            for t in 0..pair.n_frames() {
                if let Some([p, g]) = speeds(&pair.interval, t, row) {
                    let sums = blocks.at(t);
                    (sums[0], sums[1], sums[2]) = (sums[0] + p, sums[1] + g, sums[2] + 1.0);
                }
            }
        }),
        MetricFamily::new(
            vec![hellinger],
            2 * N_BINS,
            move |pair, blocks| {
                for t in 0..pair.n_frames() {
                    let speeds = speeds(&pair.interval, t, row).into_iter().flatten().enumerate();
                    for (of, speed) in speeds.filter(|(_, speed)| *speed < BIN * N_BINS as f64) {
                        blocks.at(t)[of * N_BINS + (speed / BIN) as usize] += 1.0;
                    }
                }
            },
            |sums| {
                let (predicted, ground_truth) = sums.split_at(N_BINS);
                vec![hellinger::distance(predicted, ground_truth)]
            },
        ),
        MetricFamily::new(
            vec![correlation],
            3 * 6,
            move |pair, blocks| {
                for (t, k) in angles(pair) {
                    if let Some([p, g]) = both(&pair.interval, t, row, k) {
                        let sums = blocks.at(t)[6 * k..].iter_mut();
                        sums.zip([1.0, p, g, p * p, g * g, p * g]).for_each(|(sum, v)| *sum += v);
                    }
                }
            },
            |sums| {
                let of = |sums: &[f64]| {
                    let n = sums[0].max(1.0);
                    let [p, g, pp, gg, pg] = std::array::from_fn(|i| sums[i + 1] / n);
                    let [of_p, of_g] = [pp - p * p, gg - g * g];
                    // The variance of a constant is only a rounding error.
                    (of_p.min(of_g) > MIN_VARIANCE).then(|| (pg - p * g) / (of_p * of_g).sqrt())
                };
                let moving: Vec<f64> = sums.chunks_exact(6).filter_map(of).collect();
                vec![moving.iter().sum::<f64>() / moving.len() as f64]
            },
        ),
    ]
}

fn angles(pair: &PairedFrames) -> impl Iterator<Item = (usize, usize)> + use<> {
    (0..pair.n_frames()).flat_map(|t| (0..3).map(move |k| (t, k)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::catalogue::Catalogue;
    use crate::metrics::settings::MetricSettings;
    use ndarray::{Array2, Array3};

    /// Motion whose head is at `yaw` radians as a function of seconds, and not visible in frame 3.
    fn turning(yaw: impl Fn(f32) -> f32) -> Array3<f32> {
        let mut motion = Array3::zeros((60, N_JOINTS + 2, 3));
        for t in 0..60 {
            motion[[t, N_JOINTS, 0]] = yaw(t as f32 / 15.0);
        }
        motion[[3, N_JOINTS, 0]] = f32::NAN;
        motion
    }

    #[test]
    fn metrics_match_their_formulas() {
        let channels = vec![PostureChannel::Head];
        let catalogue = Catalogue::new(&MetricSettings { channels, ..MetricSettings::default() }).unwrap();
        let mask = Array2::from_elem((60, N_JOINTS), true);
        let value = |predicted: &Array3<f32>, ground_truth: &Array3<f32>, name: &str| {
            let (predicted, ground_truth) = (predicted.view(), ground_truth.view());
            let fps = orator_base::types::time::FrameRate::new(15, 1);
            let pair = MotionPair { predicted, ground_truth, mask: mask.view(), fps, onsets: None };
            let at = catalogue.definitions().iter().position(|d| d.name == name && d.part == "head").unwrap();
            catalogue.values(&catalogue.measure(&pair))[at]
        };
        let degrees = |degrees: f32| degrees.to_radians();
        let (slow, fast) = (turning(|secs| degrees(10.0 * secs)), turning(|secs| degrees(22.0 * secs + 6.0)));
        let near = |value: f64, expected: f64| assert!((value - expected).abs() < 1e-3, "{value} {expected}");
        // The error grows from 6 degrees by 12 per second in all frames but one; the other two angles have no error.
        let total_error: f64 = (0..60).filter(|t| *t != 3).map(|t| 6.0 + 12.0 * f64::from(t) / 15.0).sum();
        near(value(&fast, &slow, "angle_error"), total_error / 179.0);
        // Two of the 59 steps have no yaw, so that their speed is 0.
        near(value(&fast, &slow, "angular_speed"), 22.0 * 57.0 / 59.0);
        near(value(&fast, &slow, "angular_speed_of_real"), 10.0 * 57.0 / 59.0);
        near(value(&fast, &slow, "hellinger_angular_speed"), (1.0 - 2.0f64 / 59.0).sqrt());
        near(value(&slow, &slow, "hellinger_angular_speed"), 0.0);
        near(value(&fast, &slow, "angle_correlation"), 1.0);
        near(value(&turning(|secs| -secs), &slow, "angle_correlation"), -1.0);
        // Errors wrap around at half a turn.
        let (left, right) = (turning(|_| degrees(179.0)), turning(|_| degrees(-179.0)));
        near(value(&left, &right, "angle_error"), 2.0 * 59.0 / 179.0);
        assert!(value(&left, &right, "angle_correlation").is_nan());
        let unknown = Array3::from_elem((60, N_JOINTS, 3), 0.0);
        assert!(value(&unknown, &slow, "angle_error").is_nan());
    }
}
