//! Beat consistency of the trimodal convention (Liu et al. 2022 on the dataset of Yoon et al.; `get_BCscore` of Yi et
//! al. 2023): beats are local minima of the change of the angle between neighbouring bones.

use super::consistency::beat_proximity;
use crate::metrics::definition::{Better, Definition, MetricFamily};
use crate::metrics::pair::PairedFrames;
use crate::metrics::sums::BlockSums;
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::skeleton::{L_ELBOW, L_SHOULDER, L_WRIST, N_JOINTS, NECK, R_ELBOW, R_SHOULDER, R_WRIST};
use serde_json::json;
use std::f64::consts::PI;

/// Three joints of two neighbouring bones, and the mean change of their angle in the original dataset, half turns per
/// frame.
const ANGLES: [([usize; 3], f64); 4] = [
    ([NECK, R_SHOULDER, R_ELBOW], 0.003_454_075_893_387_198_4),
    ([R_SHOULDER, R_ELBOW, R_WRIST], 0.007_043_459_918_349_981),
    ([NECK, L_SHOULDER, L_ELBOW], 0.003_493_624_273_687_601),
    ([L_SHOULDER, L_ELBOW, L_WRIST], 0.007_205_077_446_997_166),
];
/// Frame rate of the original dataset.
const FPS: f64 = 15.0;
const SIGMA: f64 = 0.1;
/// Smallest depth of a minimum below one of its neighbours.
const DROP: f64 = 0.01;

/// Beat consistency for data at `fps`.
pub(crate) fn metric(fps: f64) -> MetricFamily {
    // Mean change of an angle per frame of the data.
    let angles = ANGLES.map(|(joints, mean)| (joints, mean * (FPS / fps)));
    let definition = Definition {
        formula: "sum over intervals, angles and onsets of exp(-d^2 / 2 sigma^2), d to the nearest beat of the angle, \
                  divided by the number of onsets of all angles that have a beat in the interval (an angle without \
                  is left out). Angles in half turns between neck-shoulder, upper arm and forearm; |change from frame \
                  to frame| / average change / 4, 0 in the first frame; beats: minima among 3 frames at least `drop` \
                  below one neighbour",
        undefined: "there is no audio, no onset in it, or no angle has a beat",
        parameters: json!({"sigma_secs": SIGMA, "drop": DROP, "average_change": angles.map(|(_, mean)| mean)}),
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
                            sums[0] += beat_proximity(onset, beats, SIGMA);
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
        _ if visible(t) && visible(t - 1) => (angle(t) - angle(t - 1)).abs() / mean / ANGLES.len() as f64,
        _ => f64::NAN,
    };
    let changes: Vec<f64> = (0..pair.n_frames()).map(change).collect();
    let is_beat = |w: &[f64]| w[1] < w[0] && w[1] < w[2] && (w[0] - w[1] >= DROP || w[2] - w[1] >= DROP);
    let beats = changes.windows(3).enumerate().filter(|(_, w)| is_beat(w));
    Some(beats.map(|(i, _)| (i + 1) as f64 / pair.fps).collect())
}
