//! Smoothing that follows the noise there is. Around every frame a parabola is fitted under Gaussian windows of growing
//! width, and the widest is taken whose result differs from those of all narrower ones by no more than noise and a
//! tolerance explain (Lepski 1990): a still limb is smoothed over long, a stroke stays as it is. Nothing comes late.

use super::order::{Ordered, lower_quantile};
use super::vec3::{Vec3, add, dot, norm, scale, sub};
use std::collections::BTreeMap;
use std::ops::Range;

/// The filter for one frame rate.
#[derive(Clone, Debug)]
pub struct LocalFit {
    /// Standard deviations of the windows, frames, ascending.
    sigmas: Vec<f64>,
    /// Frames on each side over which the noise is measured.
    noise_half: usize,
    /// Frames on each side over which the chosen windows are evened out.
    even_half: usize,
    /// Factor of the measured noise.
    strength: f64,
    /// Change that is always allowed, in the unit of the values.
    tolerance: f64,
}

/// Standard deviation of the narrowest window, frames, and the ratio of one to the next.
const NARROWEST: f64 = 0.55;
const RATIO: f64 = 1.4;
/// Standard deviation of the widest window, seconds.
const WIDEST_SECS: f64 = 0.30;
/// Extent of a window, standard deviations on each side.
const EXTENT: f64 = 3.0;
/// Time on each side over which the noise is measured, and over which the windows are evened out, seconds.
const NOISE_SECS: f64 = 2.5;
const EVEN_SECS: f64 = 0.14;
/// Quantile of the windows chosen around a frame that holds for it.
const NARROW: f64 = 0.25;
/// Difference of two fits that is no more noise, in standard deviations of what noise makes of it.
const BIAS: f64 = 2.5;

/// Windows around a frame, the frame alone first: the weights with which each makes its fit of the frames around, and for
/// every pair (wide, narrow) the root mean square of what white noise of unit deviation adds to the difference of their
/// fits.
struct Windows {
    weights: Vec<Vec<f64>>,
    differences: Vec<Vec<f64>>,
}

impl LocalFit {
    /// Filter for `fps` frames a second. `strength`: factor of the noise that is measured; `tolerance`: change of a value
    /// that is allowed even where there is no noise.
    pub fn new(fps: f64, strength: f64, tolerance: f64) -> Self {
        let widest = (WIDEST_SECS * fps).clamp(NARROWEST, 1000.0);
        let sigmas = std::iter::successors(Some(NARROWEST), |sigma| Some(sigma * RATIO));
        let frames = |secs: f64| (secs * fps).round().clamp(1.0, 10_000.0) as usize;
        let sigmas = sigmas.take_while(|&sigma| sigma <= widest).collect();
        Self { sigmas, noise_half: frames(NOISE_SECS), even_half: frames(EVEN_SECS), strength, tolerance }
    }

    /// The smoothed run. `known`: deviation of the noise that is known beforehand, frame by frame, for as many as there
    /// are.
    pub fn run(&self, values: &[Vec3], known: &[f64]) -> Vec<Vec3> {
        let mut noise = noise_around(values, self.noise_half);
        for (t, noise) in noise.iter_mut().enumerate() {
            let around = t.saturating_sub(self.even_half)..(t + self.even_half + 1);
            let known = around.filter_map(|u| known.get(u)).fold(0.0, |most: f64, &known| most.max(known));
            *noise = noise.max(known);
        }
        let reach = (EXTENT * self.sigmas.last().copied().unwrap_or(0.0)).ceil() as usize;
        let mut windows: BTreeMap<[usize; 2], Windows> = BTreeMap::new();
        let mut chosen = Vec::with_capacity(values.len());
        let mut fits: Vec<Vec<Vec3>> = Vec::with_capacity(values.len());
        for (t, noise) in noise.into_iter().enumerate() {
            let [before, after] = [t, values.len() - 1 - t].map(|frames| frames.min(reach));
            let windows = windows.entry([before, after]).or_insert_with(|| self.windows(before, after));
            let around = &values[t - before..=t + after];
            let fit = |weights: &Vec<f64>| {
                weights.iter().zip(around).fold([0.0; 3], |sum, (&weight, &value)| add(sum, scale(value, weight)))
            };
            let fit: Vec<Vec3> = windows.weights.iter().map(fit).collect();
            chosen.push(self.widest(&fit, &windows.differences, self.strength * noise) as f64);
            fits.push(fit);
        }
        // Narrow among the frames around, so that a stroke keeps its frames though rest is beside it.
        let narrow = |t: usize| {
            let around = t.saturating_sub(self.even_half)..(t + self.even_half + 1).min(chosen.len());
            lower_quantile(chosen[around].iter().copied(), NARROW).unwrap_or(0.0)
        };
        let chosen: Vec<f64> = (0..chosen.len()).map(narrow).collect();
        let between = |(t, fits): (usize, &Vec<Vec3>)| {
            let at = evened(&chosen, t, self.even_half / 2);
            let (low, share) = (at.floor() as usize, at.fract());
            let high = fits[(low + 1).min(self.sigmas.len())];
            add(scale(fits[low], 1.0 - share), scale(high, share))
        };
        fits.iter().enumerate().map(between).collect()
    }

    /// Index of the widest fit whose difference from the narrower ones noise of `deviation` explains.
    fn widest(&self, fits: &[Vec3], differences: &[Vec<f64>], deviation: f64) -> usize {
        let is_explained = |wide: usize, narrow: usize| {
            let change = norm(sub(fits[wide], fits[narrow]));
            change <= (BIAS * deviation * differences[wide][narrow]).max(self.tolerance)
        };
        (1..fits.len()).take_while(|&wide| (0..wide).all(|narrow| is_explained(wide, narrow))).last().unwrap_or(0)
    }

    /// The windows at a frame that has so many frames before and after it.
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

/// Weights with which `frames` make the parabola fitted around `t`, read off at `t`; too few of them leave the frame.
fn parabola(frames: Range<usize>, t: usize, sigma: f64) -> Vec<f64> {
    let place = |u: usize| (u as f64 - t as f64) / sigma;
    let terms: Vec<(f64, f64)> =
        frames.map(place).map(|d| (d, if d.abs() <= EXTENT { (-0.5 * d * d).exp() } else { 0.0 })).collect();
    let moment = |power: i32| terms.iter().map(|(d, w)| w * d.powi(power)).sum::<f64>();
    let [m0, m1, m2, m3, m4] = [0, 1, 2, 3, 4].map(moment);
    // First row of the inverse of the matrix of moments, but for its determinant.
    let row = [m2 * m4 - m3 * m3, m2 * m3 - m1 * m4, m1 * m3 - m2 * m2];
    let determinant = m0 * row[0] + m1 * row[1] + m2 * row[2];
    if determinant <= 1e-9 * m0 * m2 * m4 || determinant.is_nan() {
        return terms.iter().map(|(d, _)| f64::from(u8::from(*d == 0.0))).collect();
    }
    terms.iter().map(|(d, w)| w * (row[0] + row[1] * d + row[2] * d * d) / determinant).collect()
}

/// Mean of the values around `t`, weighted by a triangle.
fn evened(values: &[f64], t: usize, half: usize) -> f64 {
    let (start, end) = (t.saturating_sub(half), (t + half + 1).min(values.len()));
    let weight = |u: usize| (half + 1 - u.abs_diff(t)) as f64;
    let (sum, total) =
        (start..end).fold((0.0, 0.0), |(sum, total), u| (sum + weight(u) * values[u], total + weight(u)));
    sum / total
}

// White noise of a track beside its motion: differences of a high order carry noise far more than motion; how much of them
// is motion shows in the ratio of two orders, which is lower for motion than for noise.

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
fn noise_around(values: &[Vec3], half: usize) -> Vec<f64> {
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

#[cfg(test)]
mod tests {
    use super::*;

    const FPS: f64 = 30.0;

    /// White noise of unit variance, from the sum of twelve numbers of a linear congruential generator.
    fn white(n: usize) -> Vec<Vec3> {
        let mut state = 1u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1u32 << 31)
        };
        (0..n).map(|_| [0, 1, 2].map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0)).collect()
    }

    fn rms(a: &[Vec3], b: &[Vec3]) -> f64 {
        (a.iter().zip(b).map(|(a, b)| norm(sub(*a, *b)).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
    }

    /// An arm that rests, falls 15 degrees in 0.12 s and returns, radians.
    fn beat() -> Vec<Vec3> {
        let angle = |t: usize| {
            let at = ((t as f64 / FPS - 2.0) / 0.12).clamp(-1.0, 1.0);
            15f64.to_radians() * (1.0 + (std::f64::consts::PI * at).cos()) / 2.0
        };
        (0..120).map(angle).map(|angle| [angle.cos(), -angle.sin(), 0.0]).collect()
    }

    #[test]
    fn a_steady_motion_and_a_run_too_short_stay() {
        let parabola: Vec<Vec3> = (0..60).map(|t| [0.1 * f64::from(t), 0.01 * f64::from(t * t), -3.0]).collect();
        assert!(rms(&LocalFit::new(FPS, 1.0, 0.01).run(&parabola, &[]), &parabola) < 1e-9);
        for n in 0..3 {
            assert_eq!(LocalFit::new(FPS, 1.0, 0.0).run(&white(60)[..n], &[]).len(), n);
        }
    }

    #[test]
    fn a_fast_beat_keeps_its_apex_and_its_energy() {
        let beat = beat();
        let smooth = LocalFit::new(FPS, 1.0, 0.005).run(&beat, &[]);
        let fall = |track: &[Vec3]| track.iter().map(|v| v[1]).fold(0.0, f64::min);
        let energy = |track: &[Vec3]| track.windows(2).map(|pair| norm(sub(pair[1], pair[0])).powi(2)).sum::<f64>();
        // 5 mm at the end of an arm of 0.6 m.
        assert!((fall(&smooth) - fall(&beat)).abs() < 0.005 / 0.6, "{} of {}", fall(&smooth), fall(&beat));
        assert!(energy(&smooth) > 0.95 * energy(&beat), "{}", energy(&smooth) / energy(&beat));
    }

    #[test]
    fn noise_goes_and_the_beat_stays() {
        let beat: Vec<Vec3> = beat().repeat(3);
        let noisy: Vec<Vec3> = beat.iter().zip(white(beat.len())).map(|(v, e)| add(*v, scale(e, 0.01))).collect();
        let smooth = LocalFit::new(FPS, 1.0, 0.0).run(&noisy, &[]);
        let (before, after) = (rms(&noisy, &beat), rms(&smooth, &beat));
        assert!(after < 0.62 * before, "{before} -> {after}");
    }
}
