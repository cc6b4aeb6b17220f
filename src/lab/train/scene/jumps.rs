//! Gross errors of a detector that last for a while: a point that jumps elsewhere, and two wrists that change places.
//! The measured noise has too few of them to learn from. Frames with one are not learnt themselves, only those around:
//! a jump shall not disturb its neighbours, and lifting refuses it by the length of the bone.

use super::hand_shape::normal;
use orator_base::motion::upper_body::{L_ELBOW, L_WRIST, NOSE, R_ELBOW, R_WRIST, SeenBody};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Share of the scenes with such errors, and the most of them in one.
const SCENES: f64 = 0.3;
const MOST: usize = 2;
/// Frames that one lasts.
const FRAMES: std::ops::RangeInclusive<usize> = 2..=32;
/// Way of a jump in widths of the shoulders, from and to.
const FAR: [f64; 2] = [0.4, 4.0];
/// Share of the errors in which the wrists change places.
const SWAPS: f64 = 0.25;

/// Disturbs `seen`; `shoulders_px`: the true width of the shoulders. Whether each frame is disturbed.
pub fn disturb(seen: &mut [SeenBody], shoulders_px: f64, rng: &mut ChaCha8Rng) -> Vec<bool> {
    let mut disturbed = vec![false; seen.len()];
    if !rng.random_bool(SCENES) || seen.len() < 2 * *FRAMES.start() {
        return disturbed;
    }
    for _ in 0..rng.random_range(1..=MOST) {
        // at least half of a scene stays as it was
        let n = rng.random_range(FRAMES).min(seen.len() / (2 * MOST));
        let start = rng.random_range(0..=seen.len() - n);
        let frames = start..start + n;
        if rng.random_bool(SWAPS) {
            seen[frames.clone()].iter_mut().for_each(|frame| frame.swap(R_WRIST, L_WRIST));
        } else {
            let point = [NOSE, R_ELBOW, L_ELBOW, R_WRIST, R_WRIST, L_WRIST, L_WRIST][rng.random_range(0..7)];
            let way = shoulders_px * rng.random_range(FAR[0].ln()..FAR[1].ln()).exp();
            let angle = rng.random_range(0.0..std::f64::consts::TAU);
            let shake = 0.03 * shoulders_px;
            for place in seen[frames.clone()].iter_mut().filter_map(|frame| frame[point].as_mut()) {
                place[0] += (way * angle.cos() + shake * normal(rng)) as f32;
                place[1] += (way * angle.sin() + shake * normal(rng)) as f32;
            }
        }
        disturbed[frames].fill(true);
    }
    disturbed
}
