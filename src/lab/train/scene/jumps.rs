//! Gross detector errors that last for several frames: a point displaced far away, or swapped wrists. The measured
//! noise has too few of them to learn from. Disturbed frames are not training targets, only their neighbours are: a
//! jump must not affect neighbouring frames, and lifting rejects it by the bone length.

use super::hand_shape::normal;
use orator_base::motion::upper_body::{BodyPoints, L_ELBOW, L_WRIST, NOSE, R_ELBOW, R_WRIST};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Share of the scenes with such errors, and their maximum number per scene.
const SCENE_SHARE: f64 = 0.3;
const MAX_ERRORS: usize = 2;
/// Duration of an error in frames.
const FRAMES: std::ops::RangeInclusive<usize> = 2..=32;
/// Smallest and largest displacement of a jump in shoulder widths.
const DISTANCE: [f64; 2] = [0.4, 4.0];
/// Share of the errors that swap the wrists.
const SWAP_SHARE: f64 = 0.25;

/// Disturbs `seen` and returns for each frame whether it is disturbed. `shoulders_px` is the true shoulder width in
/// px.
pub fn disturb(seen: &mut [BodyPoints], shoulders_px: f64, rng: &mut ChaCha8Rng) -> Vec<bool> {
    let mut disturbed = vec![false; seen.len()];
    if !rng.random_bool(SCENE_SHARE) || seen.len() < 2 * *FRAMES.start() {
        return disturbed;
    }
    for _ in 0..rng.random_range(1..=MAX_ERRORS) {
        // At least half of a scene stays undisturbed.
        let n = rng.random_range(FRAMES).min(seen.len() / (2 * MAX_ERRORS));
        let start = rng.random_range(0..=seen.len() - n);
        let frames = start..start + n;
        if rng.random_bool(SWAP_SHARE) {
            seen[frames.clone()].iter_mut().for_each(|frame| frame.swap(R_WRIST, L_WRIST));
        } else {
            let point = [NOSE, R_ELBOW, L_ELBOW, R_WRIST, R_WRIST, L_WRIST, L_WRIST][rng.random_range(0..7)];
            let distance = shoulders_px * rng.random_range(DISTANCE[0].ln()..DISTANCE[1].ln()).exp();
            let angle = rng.random_range(0.0..std::f64::consts::TAU);
            let shake = 0.03 * shoulders_px;
            for position in seen[frames.clone()].iter_mut().filter_map(|frame| frame[point].as_mut()) {
                position[0] += (distance * angle.cos() + shake * normal(rng)) as f32;
                position[1] += (distance * angle.sin() + shake * normal(rng)) as f32;
            }
        }
        disturbed[frames].fill(true);
    }
    disturbed
}
