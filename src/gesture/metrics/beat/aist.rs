//! Beat alignment of AIST++ (Li et al. 2021, `tools/calculate_beat_scores.py` in their repository): how near the beats
//! of the motion are to those of the sound. A motion with a single aligned beat scores 1.

use super::consistency::{beat_proximity, minima};
use crate::metrics::definition::{Better, BodyPart, Definition, MetricFamily};
use crate::metrics::pair::PairedFrames;
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::skeleton::N_JOINTS;
use serde_json::json;

/// Frame rate of the original code, in which `SIGMA_FRAMES` and `ORDER` are given.
const FPS: f64 = 60.0;
const SIGMA_FRAMES: f64 = 3.0;
const ORDER: f64 = 10.0;

/// Beat alignment for data at `fps`.
pub(crate) fn metric(fps: f64) -> MetricFamily {
    let order = ((ORDER / FPS * fps).round() as usize).max(1);
    let definition = Definition {
        formula: "per interval the mean over the beats of the MOTION of exp(-d^2 / 2 sigma^2), d to the nearest onset, \
                  both in whole frames; 0 for an interval without a beat; mean over intervals, long or short alike. \
                  Beats: strict local minima of the summed way of joints 1-6 from frame to frame (0 in the first), \
                  among `order` frames on either side (10 at 60 frames a second); sigma 3 frames at 60 a second. \
                  Theirs: beats of music instead of onsets, 24 joints of SMPL",
        undefined: "no interval has audio with an onset",
        parameters: json!({"sigma_secs": SIGMA_FRAMES / FPS, "order_frames": order, "joints": BodyPart::Body.joints()}),
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
        let sigma = SIGMA_FRAMES / FPS * pair.fps;
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

/// Sum of the distances that joints 1-6 moved since the previous frame, 0 in the first frame; NaN where one is not
/// visible.
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
