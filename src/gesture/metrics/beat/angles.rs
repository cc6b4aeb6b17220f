//! Beat consistency of the trimodal line (Liu et al. 2022 on the dataset of Yoon et al.; `get_BCscore` of Yi et al. 2023):
//! beats are where the angle between neighbouring bones changes slowly.

use super::consistency::nearness;
use crate::metrics::definition::{Better, Definition, MetricFamily};
use crate::metrics::pair::PairedFrames;
use crate::metrics::sums::BlockSums;
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::skeleton::{L_ELBOW, L_SHOULDER, L_WRIST, N_JOINTS, NECK, R_ELBOW, R_SHOULDER, R_WRIST};
use serde_json::json;
use std::f64::consts::PI;

/// Three joints with two bones between, and how much their angle changes on average in their dataset, half turns a frame.
const ANGLES: [([usize; 3], f64); 4] = [
    ([NECK, R_SHOULDER, R_ELBOW], 0.003_454_075_893_387_198_4),
    ([R_SHOULDER, R_ELBOW, R_WRIST], 0.007_043_459_918_349_981),
    ([NECK, L_SHOULDER, L_ELBOW], 0.003_493_624_273_687_601),
    ([L_SHOULDER, L_ELBOW, L_WRIST], 0.007_205_077_446_997_166),
];
/// Frame rate of that average.
const FPS: f64 = 15.0;
const SIGMA: f64 = 0.1;
/// A minimum must lie this far below one of its neighbours.
const DROP: f64 = 0.01;

/// For data of this frame rate.
pub(crate) fn metric(fps: f64) -> MetricFamily {
    // their average change of an angle, in a frame of the data's rate
    let angles = ANGLES.map(|(joints, usual)| (joints, usual * (FPS / fps)));
    let definition = Definition {
        formula: "sum over intervals, angles and onsets of exp(-d^2 / 2 sigma^2), d to the nearest beat of the angle, \
                  divided by the number of onsets of all angles that have a beat in the interval (an angle without \
                  is left out). Angles in half turns between neck-shoulder, upper arm and forearm; |change from frame \
                  to frame| / average change / 4, 0 in the first frame; beats: minima among 3 frames at least `drop` \
                  below one neighbour",
        undefined: "there is no sound, no onset in it, or no angle has a beat",
        parameters: json!({"sigma_secs": SIGMA, "drop": DROP, "average_change": angles.map(|(_, usual)| usual)}),
        ..Definition::new("beat_consistency", "arms", "1", Better::NearerTruth)
    };
    let measure = move |pair: &PairedFrames, blocks: &mut BlockSums| {
        let Some(onsets) = pair.interval.onsets else { return };
        for (joints, usual) in angles {
            for (i, poses) in [&pair.predicted, &pair.ground_truth].into_iter().enumerate() {
                let beats = beats(pair, poses, joints, usual);
                for &onset in onsets.iter().filter(|onset| (**onset * pair.fps) < pair.n_frames() as f64) {
                    let sums = &mut blocks.at((onset * pair.fps) as usize)[2 * i..2 * i + 2];
                    match &beats {
                        None => sums[0] = f64::NAN,
                        Some(beats) if beats.is_empty() => {}
                        Some(beats) => {
                            sums[0] += nearness(onset, beats, SIGMA);
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

/// Times of the beats of one angle, which usually changes by `usual` half turns a frame, seconds; `None` where a
/// predicted joint is not finite.
fn beats(pair: &PairedFrames, poses: &[[Vec3; N_JOINTS]], joints: [usize; 3], usual: f64) -> Option<Vec<f64>> {
    let seen = |t: usize| joints.iter().all(|joint| pair.seen[t][*joint]);
    let angle = |t: usize| {
        let [a, b, c] = joints.map(|joint| poses[t][joint]);
        let (first, second) = (vec3::sub(b, a), vec3::sub(c, b));
        let cosine = (0..3).map(|k| first[k] * second[k]).sum::<f64>() / (vec3::norm(first) * vec3::norm(second));
        cosine.clamp(-1.0, 1.0).acos() / PI
    };
    if (0..pair.n_frames()).any(|t| seen(t) && joints.iter().any(|joint| !poses[t][*joint][0].is_finite())) {
        return None;
    }
    let change = |t: usize| match t {
        0 => 0.0,
        _ if seen(t) && seen(t - 1) => (angle(t) - angle(t - 1)).abs() / usual / ANGLES.len() as f64,
        _ => f64::NAN,
    };
    let changes: Vec<f64> = (0..pair.n_frames()).map(change).collect();
    let is_beat = |w: &[f64]| w[1] < w[0] && w[1] < w[2] && (w[0] - w[1] >= DROP || w[2] - w[1] >= DROP);
    let beats = changes.windows(3).enumerate().filter(|(_, w)| is_beat(w));
    Some(beats.map(|(i, _)| (i + 1) as f64 / pair.fps).collect())
}
