//! Block bootstrap: confidence intervals of a metric from blocks drawn with replacement (Efron 1979; Kuensch 1989).

use orator_base::math::order::Ordered;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

/// Share of the draws outside the interval at each end.
const TAIL: f64 = 0.025;
const SEED: u64 = 1;

/// Metric value with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    pub value: f64,
    pub low: f64,
    pub high: f64,
}

/// `n_draws` draws of `n_blocks` blocks with replacement, from a fixed seed, so that two metrics can be compared draw
/// by draw.
pub fn draws(n_blocks: usize, n_draws: usize) -> Vec<Vec<usize>> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let block = |rng: &mut ChaCha8Rng| rng.random_range(0..n_blocks.max(1) as u64) as usize;
    (0..n_draws).map(|_| (0..n_blocks).map(|_| block(&mut rng)).collect()).collect()
}

impl Estimate {
    /// `value` of all blocks with the spread of `drawn` around their median. The draws are shifted so that their median
    /// is the value, since repeated blocks bias distances between distributions. Non-finite draws are left out.
    pub fn from_draws(value: f64, drawn: &[f64]) -> Self {
        let drawn = Ordered::new(drawn.iter().copied());
        let at = |share: f64| drawn.quantile(share).unwrap_or(f64::NAN);
        let median = at(0.5);
        Self { value, low: value + at(TAIL) - median, high: value + at(1.0 - TAIL) - median }
    }

    /// Whether 0 lies outside the interval.
    pub fn is_apart_from_zero(&self) -> bool {
        self.low > 0.0 || self.high < 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_a_mean_is_about_two_standard_errors_wide() {
        let values: Vec<f64> = (0..200).map(|i| f64::from(i * 7919 % 1009) / 1009.0).collect();
        let mean = |blocks: &[usize]| blocks.iter().map(|i| values[*i]).sum::<f64>() / blocks.len() as f64;
        let all: Vec<usize> = (0..200).collect();
        let drawn: Vec<f64> = draws(200, 1000).iter().map(|blocks| mean(blocks)).collect();
        let estimate = Estimate::from_draws(mean(&all), &drawn);
        let variance = values.iter().map(|v| (v - estimate.value).powi(2)).sum::<f64>() / 200.0;
        let expected = 2.0 * 1.96 * (variance / 200.0).sqrt();
        let width = estimate.high - estimate.low;
        assert!((width / expected - 1.0).abs() < 0.1, "{width} {expected}");
        assert!(estimate.low < estimate.value && estimate.value < estimate.high && estimate.is_apart_from_zero());
        let none = Estimate::from_draws(1.0, &[f64::NAN]);
        assert!(none.value == 1.0 && none.low.is_nan() && !none.is_apart_from_zero());
    }
}
