//! Smoothing that adapts to the measured noise. A parabola is fitted around every frame under Gaussian windows of
//! increasing width, and the widest window is chosen whose result differs from those of all narrower ones by no more
//! than noise and a tolerance explain (Lepski 1990): a static limb is smoothed long, a stroke is unchanged. No delay.

use super::order::{Ordered, lower_quantile};
use super::vec3::{Vec3, add, dot, norm, scale, sub};
use std::collections::BTreeMap;
use std::ops::Range;

/// Filter for one frame rate.
#[derive(Clone, Debug)]
pub struct LocalFit {
    /// Standard deviations of the windows in frames, ascending.
    sigmas: Vec<f64>,
    /// Number of frames on each side over which the noise is measured.
    noise_half: usize,
    /// Number of frames on each side over which the chosen windows are smoothed.
    smooth_half: usize,
    /// Factor applied to the measured noise.
    strength: f64,
    /// Change that is always accepted, in the unit of the values.
    tolerance: f64,
}

/// Standard deviation of the narrowest window in frames, and the ratio between successive windows.
const NARROWEST: f64 = 0.55;
const RATIO: f64 = 1.4;
/// Standard deviation of the widest window in seconds.
const WIDEST_SECS: f64 = 0.30;
/// Half width of a window in standard deviations.
const EXTENT: f64 = 3.0;
/// Durations on each side over which the noise is measured and over which the windows are smoothed, seconds.
const NOISE_SECS: f64 = 2.5;
const SMOOTH_SECS: f64 = 0.14;
/// Quantile of the windows chosen in nearby frames that is used for a frame.
const NARROW_QUANTILE: f64 = 0.25;
/// Difference of two fits that noise no longer explains, in standard deviations of the noise in that difference.
const BIAS: f64 = 2.5;

/// Windows around a frame, first the frame alone: the weights of the nearby frames in each window's fit, and for every
/// pair (wide, narrow) the root mean square of the difference of their fits for white noise of unit standard deviation.
struct Windows {
    weights: Vec<Vec<f64>>,
    differences: Vec<Vec<f64>>,
}

impl LocalFit {
    /// Creates a filter for `fps` frames per second. `strength` is a factor applied to the measured noise; `tolerance`
    /// is a change of a value that is accepted even without noise.
    pub fn new(fps: f64, strength: f64, tolerance: f64) -> Self {
        let widest = (WIDEST_SECS * fps).clamp(NARROWEST, 1000.0);
        let sigmas = std::iter::successors(Some(NARROWEST), |sigma| Some(sigma * RATIO));
        let frames = |secs: f64| (secs * fps).round().clamp(1.0, 10_000.0) as usize;
        let sigmas = sigmas.take_while(|&sigma| sigma <= widest).collect();
        Self { sigmas, noise_half: frames(NOISE_SECS), smooth_half: frames(SMOOTH_SECS), strength, tolerance }
    }

    /// Smooths a run of values. `known`: standard deviations of the noise per frame; it may be shorter than the run.
    pub fn run(&self, values: &[Vec3], known: &[f64]) -> Vec<Vec3> {
        let mut noise = noise_around(values, self.noise_half);
        for (t, noise) in noise.iter_mut().enumerate() {
            let around = t.saturating_sub(self.smooth_half)..(t + self.smooth_half + 1);
            let known = around.filter_map(|u| known.get(u)).fold(0.0, |max: f64, &known| max.max(known));
            *noise = noise.max(known);
        }
        let half_width = (EXTENT * self.sigmas.last().copied().unwrap_or(0.0)).ceil() as usize;
        let mut windows: BTreeMap<[usize; 2], Windows> = BTreeMap::new();
        let mut chosen = Vec::with_capacity(values.len());
        let mut fits: Vec<Vec<Vec3>> = Vec::with_capacity(values.len());
        for (t, noise) in noise.into_iter().enumerate() {
            let [before, after] = [t, values.len() - 1 - t].map(|frames| frames.min(half_width));
            let windows = windows.entry([before, after]).or_insert_with(|| self.windows(before, after));
            let around = &values[t - before..=t + after];
            let fit = |weights: &Vec<f64>| {
                weights.iter().zip(around).fold([0.0; 3], |sum, (&weight, &value)| add(sum, scale(value, weight)))
            };
            let fit: Vec<Vec3> = windows.weights.iter().map(fit).collect();
            chosen.push(self.widest(&fit, &windows.differences, self.strength * noise) as f64);
            fits.push(fit);
        }
        // A low quantile of the nearby frames, so that a stroke keeps its frames when a rest is beside it.
        let narrow = |t: usize| {
            let around = t.saturating_sub(self.smooth_half)..(t + self.smooth_half + 1).min(chosen.len());
            lower_quantile(chosen[around].iter().copied(), NARROW_QUANTILE).unwrap_or(0.0)
        };
        let chosen: Vec<f64> = (0..chosen.len()).map(narrow).collect();
        let between = |(t, fits): (usize, &Vec<Vec3>)| {
            let at = triangular_mean(&chosen, t, self.smooth_half / 2);
            let (low, share) = (at.floor() as usize, at.fract());
            let high = fits[(low + 1).min(self.sigmas.len())];
            add(scale(fits[low], 1.0 - share), scale(high, share))
        };
        fits.iter().enumerate().map(between).collect()
    }

    /// Index of the widest fit whose differences from the narrower ones are explained by noise of `deviation`.
    fn widest(&self, fits: &[Vec3], differences: &[Vec<f64>], deviation: f64) -> usize {
        let is_explained = |wide: usize, narrow: usize| {
            let change = norm(sub(fits[wide], fits[narrow]));
            change <= (BIAS * deviation * differences[wide][narrow]).max(self.tolerance)
        };
        (1..fits.len()).take_while(|&wide| (0..wide).all(|narrow| is_explained(wide, narrow))).last().unwrap_or(0)
    }

    /// Windows of a frame that has `before` frames before it and `after` frames after it.
    fn windows(&self, before: usize, after: usize) -> Windows {
        let alone = (0..=before + after).map(|u| f64::from(u8::from(u == before))).collect();
        let wider = self.sigmas.iter().map(|&sigma| parabola(0..before + after + 1, before, sigma));
        let weights: Vec<Vec<f64>> = std::iter::once(alone).chain(wider).collect();
        let difference = |wide: &Vec<f64>, narrow: &Vec<f64>| {
            (3.0 * wide.iter().zip(narrow).map(|(a, b)| (a - b).powi(2)).sum::<f64>()).sqrt()
        };
        let differences =
            weights.iter().map(|wide| weights.iter().map(|narrow| difference(wide, narrow)).collect()).collect();
        Windows { weights, differences }
    }
}

/// Weights of `frames` in the parabola fitted around `t`, evaluated at `t`; too few frames give weight 1 to `t` alone.
fn parabola(frames: Range<usize>, t: usize, sigma: f64) -> Vec<f64> {
    let distance = |u: usize| (u as f64 - t as f64) / sigma;
    let terms: Vec<(f64, f64)> =
        frames.map(distance).map(|d| (d, if d.abs() <= EXTENT { (-0.5 * d * d).exp() } else { 0.0 })).collect();
    let moment = |power: i32| terms.iter().map(|(d, w)| w * d.powi(power)).sum::<f64>();
    let [m0, m1, m2, m3, m4] = [0, 1, 2, 3, 4].map(moment);
    // First row of the inverse of the matrix of moments, without the division by the determinant.
    let row = [m2 * m4 - m3 * m3, m2 * m3 - m1 * m4, m1 * m3 - m2 * m2];
    let determinant = m0 * row[0] + m1 * row[1] + m2 * row[2];
    if determinant <= 1e-9 * m0 * m2 * m4 || determinant.is_nan() {
        return terms.iter().map(|(d, _)| f64::from(u8::from(*d == 0.0))).collect();
    }
    terms.iter().map(|(d, w)| w * (row[0] + row[1] * d + row[2] * d * d) / determinant).collect()
}

/// Mean of the values around `t` with triangular weights.
fn triangular_mean(values: &[f64], t: usize, half: usize) -> f64 {
    let (start, end) = (t.saturating_sub(half), (t + half + 1).min(values.len()));
    let weight = |u: usize| (half + 1 - u.abs_diff(t)) as f64;
    let (sum, total) =
        (start..end).fold((0.0, 0.0), |(sum, total), u| (sum + weight(u) * values[u], total + weight(u)));
    sum / total
}

// Estimation of the white noise in a moving track: differences of high order contain far more noise than motion, and
// the ratio of two orders, which is lower for motion than for noise, shows how much of them is motion.

/// Mean squares of the third and fourth differences of unit white noise (sums of squared binomial coefficients).
const THIRD: f64 = 20.0;
const FOURTH: f64 = 70.0;
/// Ratio of the two for motion: 1.4 to 1.7 for captured arms at 15 frames per second, less at 30.
const MOTION_RATIO: f64 = 1.7;
/// Number of frames over which the differences are averaged.
const MEAN_FRAMES: usize = 9;
/// Quantile of those means, unaffected by strokes, and its ratio to the mean for white noise in three coordinates.
const QUIET_QUANTILE: f64 = 0.3;
const QUIET_SHARE: f64 = 0.8;

/// Standard deviation of the noise of one coordinate per frame, over `half` frames on either side; 0 for a short run.
fn noise_around(values: &[Vec3], half: usize) -> Vec<f64> {
    let n = values.len();
    if n < MEAN_FRAMES + 4 {
        return vec![0.0; n];
    }
    let (third, fourth) = (differences(values, 3), differences(values, 4));
    let power = |values: &[Vec3]| values.iter().map(|v| dot(*v, *v)).sum::<f64>() / values.len() as f64;
    let variance = |i: usize| {
        let (third, fourth) = (power(&third[i..=i + MEAN_FRAMES]), power(&fourth[i..i + MEAN_FRAMES]));
        (fourth - MOTION_RATIO * third) / (FOURTH - MOTION_RATIO * THIRD) / 3.0
    };
    let variances: Vec<f64> = (0..=fourth.len() - MEAN_FRAMES).map(variance).collect();
    (0..n)
        .map(|t| {
            // The differences of mean `i` are centred on frame `i + MEAN_FRAMES / 2 + 2`.
            let at = t.saturating_sub(MEAN_FRAMES / 2 + 2).min(variances.len() - 1);
            let around = &variances[at.saturating_sub(half)..(at + half + 1).min(variances.len())];
            let quiet = Ordered::new(around.iter().copied()).quantile(QUIET_QUANTILE).unwrap_or(0.0);
            (quiet / QUIET_SHARE).max(0.0).sqrt()
        })
        .collect()
}

fn differences(values: &[Vec3], order: usize) -> Vec<Vec3> {
    (0..order).fold(values.to_vec(), |values, _| values.windows(2).map(|pair| sub(pair[1], pair[0])).collect())
}
