//! Block bootstrap: confidence intervals of a metric from blocks drawn with replacement (Efron 1979; Kuensch 1989).

use ndarray::Array2;
use orator_base::math::estimate::Estimate;
use orator_base::math::order::Ordered;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Share of the draws beyond each end of the interval.
const TAIL: f64 = 0.025;
const SEED: u64 = 1;

/// Multiplicity of each block in each of `n_draws` draws of `n_blocks` blocks with replacement, [n_draws, n_blocks].
/// The seed is fixed, so that two metrics can be compared draw by draw.
pub fn counts(n_blocks: usize, n_draws: usize) -> Array2<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut counts = Array2::zeros((n_draws, n_blocks));
    for mut draw in counts.outer_iter_mut() {
        (0..n_blocks).for_each(|_| draw[rng.random_range(0..n_blocks as u64) as usize] += 1.0);
    }
    counts
}

/// `value` over all blocks with its 95 % interval from the quantiles of `drawn`. The draws are shifted so that their
/// median is `value`, since repeated blocks bias distances between distributions. Non-finite draws are ignored.
pub fn estimate(value: f64, drawn: &[f64]) -> Estimate {
    let drawn = Ordered::new(drawn.iter().copied());
    let at = |share: f64| drawn.quantile(share).unwrap_or(f64::NAN);
    let median = at(0.5);
    Estimate::new(value, value + at(TAIL) - median, value + at(1.0 - TAIL) - median)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array1;

    #[test]
    fn the_interval_of_a_mean_is_about_two_standard_errors_wide() {
        let values: Vec<f64> = (0..200).map(|i| f64::from(i * 7919 % 1009) / 1009.0).collect();
        let mean = values.iter().sum::<f64>() / 200.0;
        let drawn: Vec<f64> = (counts(200, 1000).dot(&Array1::from(values.clone())) / 200.0).to_vec();
        let Estimate { value, interval } = estimate(mean, &drawn);
        let variance = values.iter().map(|v| (v - value).powi(2)).sum::<f64>() / 200.0;
        let expected = 2.0 * 1.96 * (variance / 200.0).sqrt();
        let width = interval.high - interval.low;
        assert!((width / expected - 1.0).abs() < 0.1, "{width} {expected}");
        assert!(interval.low < value && value < interval.high && interval.excludes_zero());
        let none = super::estimate(1.0, &[f64::NAN]);
        assert!(none.value == 1.0 && none.interval.low.is_nan() && !none.interval.excludes_zero());
    }
}
