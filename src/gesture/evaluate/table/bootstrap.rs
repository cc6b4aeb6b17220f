//! Confidence intervals of a metric from blocks drawn with replacement (Efron 1979; Kuensch 1989), and contributions of
//! groups of blocks to a metric that is any function of sums over blocks, from the values without each group (the
//! jackknife; Efron and Tibshirani 1993, chapter 11). For a mean over frames they are the groups' own sums.

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

/// Largest number of groups. If there are more blocks, neighbours are merged, which limits the number of values to
/// compute and makes the groups less dependent.
const MAX_GROUPS: usize = 32;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct BlockGroups {
    of_block: Vec<usize>,
    /// Share of the frames in each group, sum 1.
    pub shares: Vec<f64>,
}

impl BlockGroups {
    pub fn new(frames: &[usize]) -> Self {
        let n = frames.len().min(MAX_GROUPS);
        let of_block: Vec<usize> = (0..frames.len()).map(|block| block * n / frames.len()).collect();
        let total = frames.iter().sum::<usize>().max(1) as f64;
        let mut shares = vec![0.0; n];
        of_block.iter().zip(frames).for_each(|(group, frames)| shares[*group] += *frames as f64 / total);
        Self { of_block, shares }
    }

    pub fn len(&self) -> usize {
        self.shares.len()
    }

    pub fn is_empty(&self) -> bool {
        self.shares.is_empty()
    }

    /// Weights of the blocks without each group [groups, blocks]: 0 or 1.
    pub fn counts_without(&self) -> Array2<f64> {
        let is_included = |(group, block): (usize, usize)| f64::from(u8::from(self.of_block[block] != group));
        Array2::from_shape_fn((self.shares.len(), self.of_block.len()), is_included)
    }

    /// Contribution of each group in the unit of `value`, which is also their mean. `value` is the metric over all
    /// blocks, `without` the metric without each group.
    pub fn contributions(&self, value: f64, without: &[f64]) -> Vec<f64> {
        let n = self.shares.len() as f64;
        let own = |(share, without): (&f64, &f64)| n * (1.0 - share) * (value - without);
        let changes: Vec<f64> = self.shares.iter().zip(without).map(own).collect();
        let bias = changes.iter().sum::<f64>() / n;
        self.shares.iter().zip(changes).map(|(share, change)| n * share * value + change - bias).collect()
    }
}
