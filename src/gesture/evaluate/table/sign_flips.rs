//! Sign-flip test whether paired differences of blocks are symmetric about 0 (Fisher 1935; for dependent data in
//! blocks: Canay, Romano and Shaikh 2017). Several metrics are flipped together, and each statistic is compared with
//! the largest of all metrics (Westfall and Young 1993), which controls the family-wise error rate.

use orator_base::math::estimate::Estimate;
use rand::{RngCore, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Significance level of a test. It is half of 5 %, since the decorrelation time is an estimate and leaves some
/// dependence; with it the simulated rates of false conclusions stay below 5 %.
pub const LEVEL: f64 = 0.025;
/// Smallest number of blocks with which a test can reject: the observed signs and their negative are 2 of 2^n flips.
pub const MIN_BLOCKS: usize = 7;
/// Largest number of blocks for which all flips are enumerated.
pub const MAX_EXACT: usize = 16;
/// Number of random flips for more blocks; the observed signs are added to them (Phipson and Smyth 2010).
const N_RANDOM: usize = 9999;
const SEED: u64 = 1;
/// Tolerance within which two statistics count as equal.
const ROUNDING: f64 = 1e-9;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TestedDifference {
    /// Mean with the simultaneous interval, which excludes 0 if `p` is at most [`LEVEL`]. The interval is infinite if
    /// no mean could be rejected.
    pub mean: Estimate,
    /// Two-sided p value, adjusted for the number of metrics.
    pub p: f64,
}

/// Tests several metrics together. `differences` has one value per block for each metric, all of equal length.
/// `inflation` (at least 1) is the variance of the mean of the blocks relative to independent blocks. Metrics with
/// values that are not finite have p = 1 and no interval.
pub fn test(differences: &[Vec<f64>], inflation: f64) -> Vec<TestedDifference> {
    let n = differences.iter().map(Vec::len).min().unwrap_or(0);
    let units: Vec<Option<Vec<f64>>> = differences.iter().map(|metric| unit(&metric[..n])).collect();
    let mut largest = largest_sums(&units.iter().flatten().collect::<Vec<_>>(), n);
    largest.sort_by(f64::total_cmp);
    let n_flips = largest.len();
    let n_beyond = |size: f64| n_flips - largest.partition_point(|other| *other < size - ROUNDING);
    let n_rejected = (LEVEL * n_flips as f64 + ROUNDING) as usize;
    // Sums above this one are rejected.
    let critical = largest.len().checked_sub(n_rejected + 1).map_or(f64::INFINITY, |k| largest[k] + ROUNDING);
    let of_metric = |(metric, unit): (&Vec<f64>, &Option<Vec<f64>>)| {
        let blocks = n as f64;
        let mean = metric[..n].iter().sum::<f64>() / blocks;
        let Some(unit) = unit else {
            let none = if mean == 0.0 { 0.0 } else { f64::NAN };
            return TestedDifference { mean: Estimate::new(mean, none, none), p: 1.0 };
        };
        // The sum of the unit vector is a monotonic function of Student's t, whose square is divided by the inflation.
        let size = unit.iter().sum::<f64>().abs();
        let rest = (1.0 - size * size / blocks).max(0.0);
        let deflated = size / (rest * inflation + size * size / blocks).sqrt();
        let p = n_beyond(deflated) as f64 / n_flips as f64;
        let spread: f64 = metric[..n].iter().map(|value| (value - mean).powi(2)).sum();
        let remainder = blocks - critical * critical;
        let half_width =
            if remainder > 0.0 { critical * (inflation * spread / (blocks * remainder)).sqrt() } else { f64::INFINITY };
        TestedDifference { mean: Estimate::new(mean, mean - half_width, mean + half_width), p }
    };
    differences.iter().zip(&units).map(of_metric).collect()
}

/// Values scaled to a sum of squares of 1; `None` if all are 0, or one is not finite.
fn unit(values: &[f64]) -> Option<Vec<f64>> {
    let largest = values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    if !(largest > 0.0 && values.iter().all(|value| value.is_finite())) {
        return None;
    }
    let length = values.iter().map(|value| (value / largest).powi(2)).sum::<f64>().sqrt();
    Some(values.iter().map(|value| value / largest / length).collect())
}

/// Largest absolute sum over the metrics for every flip of the signs, or for the observed signs and random flips.
fn largest_sums(units: &[&Vec<f64>], n: usize) -> Vec<f64> {
    let largest = |is_negative: &dyn Fn(usize) -> bool| {
        let sum = |unit: &&Vec<f64>| {
            let signed = unit.iter().enumerate().map(|(i, value)| if is_negative(i) { -value } else { *value });
            signed.sum::<f64>().abs()
        };
        units.iter().map(sum).fold(0.0, f64::max)
    };
    if n <= MAX_EXACT {
        // A flip and its negative have the same magnitude, so the last sign is fixed and each sum counts twice.
        let half_sums = (0..1_u64 << n.saturating_sub(1)).map(|flip| largest(&|i| flip >> i & 1 == 1));
        return half_sums.flat_map(|sum| [sum; 2]).collect();
    }
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut bits = vec![0_u64; n.div_ceil(64)];
    let mut sums = vec![largest(&|_| false)];
    for _ in 0..N_RANDOM {
        bits.fill_with(|| rng.next_u64());
        sums.push(largest(&|i| bits[i / 64] >> (i % 64) & 1 == 1));
    }
    sums
}
