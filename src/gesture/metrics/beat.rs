//! Beat metrics: alignment of the beats of the motion with those of the sound. Beat alignment of AIST++ (Li et al.
//! 2021, `tools/calculate_beat_scores.py` in their repository): how near the beats of the motion are to those of the
//! sound; a motion with a single aligned beat scores 1. Beat consistency of the trimodal convention (Liu et al. 2022 on
//! the dataset of Yoon et al.; `get_BCscore` of Yi et al. 2023), whose beats are minima of the change of the angle
//! between neighbouring bones, of the emage convention (Liu et al. 2024), and a simpler one of this project.

use crate::metrics::definition::{Better, BodyPart, Definition, MetricFamily};
use crate::metrics::pair::PairedFrames;
use crate::metrics::sums::BlockSums;
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::skeleton::{L_ELBOW, L_SHOULDER, L_WRIST, N_JOINTS, NECK, R_ELBOW, R_SHOULDER, R_WRIST};
use serde_json::json;
use std::f64::consts::PI;

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
pub fn beat_proximity(time: f64, times: &[f64], sigma: f64) -> f64 {
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

/// Absolute deviations from the mean by coordinate. The original code computes L1div in place, and finds beats in it.
fn abs_deviations(positions: &[Vec3]) -> Vec<Vec3> {
    let visible: Vec<&Vec3> = positions.iter().filter(|p| p.iter().all(|v| v.is_finite())).collect();
    let mean: Vec3 = std::array::from_fn(|k| visible.iter().map(|p| p[k]).sum::<f64>() / visible.len() as f64);
    positions.iter().map(|p| std::array::from_fn(|k| (p[k] - mean[k]).abs())).collect()
}

/// Frame rate of the original code, in which `SIGMA_FRAMES` and `AIST_ORDER` are given.
const AIST_FPS: f64 = 60.0;
const SIGMA_FRAMES: f64 = 3.0;
const AIST_ORDER: f64 = 10.0;

/// Beat alignment for data at `fps`.
pub(crate) fn aist(fps: f64) -> MetricFamily {
    let order = ((AIST_ORDER / AIST_FPS * fps).round() as usize).max(1);
    let definition = Definition {
        formula: "per interval the mean over the beats of the MOTION of exp(-d^2 / 2 sigma^2), d to the nearest onset, \
                  both in whole frames; 0 for an interval without a beat; mean over intervals, long or short alike. \
                  Beats: strict local minima of the summed way of joints 1-6 from frame to frame (0 in the first), \
                  among `order` frames on either side (10 at 60 frames a second); sigma 3 frames at 60 a second. \
                  Theirs: beats of music instead of onsets, 24 joints of SMPL",
        undefined: "no interval has audio with an onset",
        parameters: json!({"sigma_secs": SIGMA_FRAMES / AIST_FPS, "order_frames": order, "joints": BodyPart::Body.joints()}),
        ..Definition::new("beat_alignment", BodyPart::Body.name(), "1", Better::NearerTruth)
    };
    MetricFamily::mean_of_both(definition.with_truth("beat_alignment_of_real"), move |pair, blocks| {
        let Some(onsets) = pair.interval.onsets else { return };
        let n = pair.n_frames();
        let frames = onsets.iter().map(|onset| (onset * pair.fps).round()).filter(|t| *t < n as f64);
        let onsets: Vec<f64> = frames.collect();
        if onsets.is_empty() {
            return;
        }
        let sigma = SIGMA_FRAMES / AIST_FPS * pair.fps;
        for (i, poses) in [&pair.predicted, &pair.ground_truth].into_iter().enumerate() {
            let beats = minima(&envelope(pair, poses), order);
            for &t in &beats {
                blocks.at(t)[i] += beat_proximity(t as f64, &onsets, sigma) / beats.len() as f64;
            }
        }
        if (0..n).any(|t| pair.n_non_finite(t) > 0) {
            blocks.at(0)[0] = f64::NAN;
        }
        // The weight of the interval is spread evenly over its frames.
        for t in 0..n {
            blocks.at(t)[2] += 1.0 / n as f64;
        }
    })
}

/// Sum of the distances joints 1-6 moved since the previous frame, 0 in the first frame; NaN where one is not visible.
fn envelope(pair: &PairedFrames, poses: &[[Vec3; N_JOINTS]]) -> Vec<f64> {
    let joints = BodyPart::Body.joints();
    let at = |t: usize| match t {
        0 => 0.0,
        _ if joints.iter().all(|joint| pair.is_visible(t - 1, 2, *joint)) => {
            joints.iter().map(|joint| vec3::norm(vec3::sub(poses[t][*joint], poses[t - 1][*joint]))).sum()
        }
        _ => f64::NAN,
    };
    (0..pair.n_frames()).map(at).collect()
}

/// Three joints of two neighbouring bones, and their angle's mean change in the original dataset, half turns per frame.
const TRIMODAL_ANGLES: [([usize; 3], f64); 4] = [
    ([NECK, R_SHOULDER, R_ELBOW], 0.003_454_075_893_387_198_4),
    ([R_SHOULDER, R_ELBOW, R_WRIST], 0.007_043_459_918_349_981),
    ([NECK, L_SHOULDER, L_ELBOW], 0.003_493_624_273_687_601),
    ([L_SHOULDER, L_ELBOW, L_WRIST], 0.007_205_077_446_997_166),
];
/// Frame rate of the original dataset.
const TRIMODAL_FPS: f64 = 15.0;
const TRIMODAL_SIGMA: f64 = 0.1;
/// Smallest depth of a minimum below one of its neighbours.
const TRIMODAL_DROP: f64 = 0.01;

/// Beat consistency for data at `fps`.
pub(crate) fn trimodal(fps: f64) -> MetricFamily {
    // Mean change of an angle per frame of the data.
    let angles = TRIMODAL_ANGLES.map(|(joints, mean)| (joints, mean * (TRIMODAL_FPS / fps)));
    let definition = Definition {
        formula: "sum over intervals, angles and onsets of exp(-d^2 / 2 sigma^2), d to the nearest beat of the angle, \
                  divided by the number of onsets of all angles that have a beat in the interval (an angle without \
                  is left out). Angles in half turns between neck-shoulder, upper arm and forearm; |change from frame \
                  to frame| / average change / 4, 0 in the first frame; beats: minima among 3 frames at least `drop` \
                  below one neighbour",
        undefined: "there is no audio, no onset in it, or no angle has a beat",
        parameters: json!({"sigma_secs": TRIMODAL_SIGMA, "drop": TRIMODAL_DROP, "average_change": angles.map(|(_, mean)| mean)}),
        ..Definition::new("beat_consistency", "arms", "1", Better::NearerTruth)
    };
    let measure = move |pair: &PairedFrames, blocks: &mut BlockSums| {
        let Some(onsets) = pair.interval.onsets else { return };
        for (joints, mean) in angles {
            for (i, poses) in [&pair.predicted, &pair.ground_truth].into_iter().enumerate() {
                let beats = beats(pair, poses, joints, mean);
                for &onset in onsets.iter().filter(|onset| (**onset * pair.fps) < pair.n_frames() as f64) {
                    let sums = &mut blocks.at((onset * pair.fps) as usize)[2 * i..2 * i + 2];
                    match &beats {
                        None => sums[0] = f64::NAN,
                        Some(beats) if beats.is_empty() => {}
                        Some(beats) => {
                            sums[0] += beat_proximity(onset, beats, TRIMODAL_SIGMA);
                            sums[1] += 1.0;
                        }
                    }
                }
            }
        }
    };
    let definitions = definition.with_truth("beat_consistency_of_real").into();
    MetricFamily::new(definitions, 4, measure, |sums| vec![sums[0] / sums[1], sums[2] / sums[3]])
}

/// Times in seconds of the beats of an angle, whose mean change is `mean` half turns per frame; `None` if a
/// predicted joint is not finite.
fn beats(pair: &PairedFrames, poses: &[[Vec3; N_JOINTS]], joints: [usize; 3], mean: f64) -> Option<Vec<f64>> {
    let visible = |t: usize| joints.iter().all(|joint| pair.visible[t][*joint]);
    let angle = |t: usize| {
        let [a, b, c] = joints.map(|joint| poses[t][joint]);
        let (first, second) = (vec3::sub(b, a), vec3::sub(c, b));
        let cosine = (0..3).map(|k| first[k] * second[k]).sum::<f64>() / (vec3::norm(first) * vec3::norm(second));
        cosine.clamp(-1.0, 1.0).acos() / PI
    };
    if (0..pair.n_frames()).any(|t| visible(t) && joints.iter().any(|joint| !poses[t][*joint][0].is_finite())) {
        return None;
    }
    let change = |t: usize| match t {
        0 => 0.0,
        _ if visible(t) && visible(t - 1) => (angle(t) - angle(t - 1)).abs() / mean / TRIMODAL_ANGLES.len() as f64,
        _ => f64::NAN,
    };
    let changes: Vec<f64> = (0..pair.n_frames()).map(change).collect();
    let is_beat =
        |w: &[f64]| w[1] < w[0] && w[1] < w[2] && (w[0] - w[1] >= TRIMODAL_DROP || w[2] - w[1] >= TRIMODAL_DROP);
    let beats = changes.windows(3).enumerate().filter(|(_, w)| is_beat(w));
    Some(beats.map(|(i, _)| (i + 1) as f64 / pair.fps).collect())
}
