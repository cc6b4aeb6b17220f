//! White noise of a track beside its motion. Differences of a high order carry noise far more than motion; how much of
//! them is motion shows in the ratio of two orders, which is lower for motion than for noise.

use super::order::Ordered;
use super::vec3::{Vec3, dot, sub};

/// Mean squares of the third and fourth differences of white noise of unit variance (sums of squared binomials).
const THIRD: f64 = 20.0;
const FOURTH: f64 = 70.0;
/// Ratio of the two for motion: captured arms have 1.4 to 1.7 at 15 frames a second, less at 30.
const MOTION: f64 = 1.7;
/// Frames over which the differences are averaged.
const MEAN_FRAMES: usize = 9;
/// Quantile of those means, which strokes do not reach, and its ratio to the mean for white noise of three coordinates.
const QUIET: f64 = 0.3;
const QUIET_SHARE: f64 = 0.8;

/// Standard deviation of the noise of one coordinate, by frame, from the frames up to `half` before and after it; 0 where
/// the run is too short to tell.
pub fn around(values: &[Vec3], half: usize) -> Vec<f64> {
    let n = values.len();
    if n < MEAN_FRAMES + 4 {
        return vec![0.0; n];
    }
    let (third, fourth) = (differences(values, 3), differences(values, 4));
    let power = |values: &[Vec3]| values.iter().map(|v| dot(*v, *v)).sum::<f64>() / values.len() as f64;
    let variance = |i: usize| {
        let (third, fourth) = (power(&third[i..=i + MEAN_FRAMES]), power(&fourth[i..i + MEAN_FRAMES]));
        (fourth - MOTION * third) / (FOURTH - MOTION * THIRD) / 3.0
    };
    let variances: Vec<f64> = (0..=fourth.len() - MEAN_FRAMES).map(variance).collect();
    (0..n)
        .map(|t| {
            // The differences of mean `i` are centred on frame `i + MEAN_FRAMES / 2 + 2`.
            let at = t.saturating_sub(MEAN_FRAMES / 2 + 2).min(variances.len() - 1);
            let around = &variances[at.saturating_sub(half)..(at + half + 1).min(variances.len())];
            let quiet = Ordered::new(around.iter().copied()).quantile(QUIET).unwrap_or(0.0);
            (quiet / QUIET_SHARE).max(0.0).sqrt()
        })
        .collect()
}

fn differences(values: &[Vec3], order: usize) -> Vec<Vec3> {
    (0..order).fold(values.to_vec(), |values, _| values.windows(2).map(|pair| sub(pair[1], pair[0])).collect())
}
