//! Ranks and order statistics: Wilcoxon's signed ranks of two paired conditions, Friedman's test of several (pairs and
//! blocks are participants, independent of each other), and a distribution-free interval of the median, as the GENEA
//! challenges print their ratings (Kucherenko et al. 2021).

use super::estimate::{ConfidenceInterval, StatisticsError, at_least, finite, tail};
use statrs::distribution::{Binomial, ChiSquared, ContinuousCDF, DiscreteCDF, Normal};

/// Outcome of a test by ranks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RankTest {
    /// Wilcoxon: smaller of the sums of ranks of positive and of negative differences. Friedman: chi-squared.
    pub statistic: f64,
    /// Two-sided p value.
    pub p: f64,
}

/// Ranks from 1, tied values with the mean of theirs, and the sizes of the groups of ties.
fn ranks(values: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let (mut ranks, mut ties) = (vec![0.0; values.len()], Vec::new());
    let mut before = 0.0;
    for tied in order.chunk_by(|a, b| values[*a] == values[*b]) {
        let n = tied.len() as f64;
        tied.iter().for_each(|index| ranks[*index] = before + (n + 1.0) / 2.0);
        ties.push(n);
        before += n;
    }
    (ranks, ties)
}

/// Probability of each sum of a random half of whole numbers: every one of `sizes` is in it with probability 1/2.
fn half_sums(sizes: &[usize]) -> Vec<f64> {
    let mut sums = vec![1.0];
    for size in sizes {
        let mut next = vec![0.0; sums.len() + size];
        for (sum, probability) in sums.iter().enumerate() {
            next[sum] += probability / 2.0;
            next[sum + size] += probability / 2.0;
        }
        sums = next;
    }
    sums
}

/// Tests whether paired `differences` are symmetric about 0; differences of 0 are left out (Wilcoxon 1945). Exact for up to
/// 50 differences without ties and zeros and for up to 13 with them, as scipy's `wilcoxon` chooses; else by the normal
/// distribution with correction for ties, without correction for continuity.
pub fn signed_rank(differences: &[f64]) -> Result<RankTest, StatisticsError> {
    finite("differences", differences)?;
    let nonzero: Vec<f64> = differences.iter().copied().filter(|difference| *difference != 0.0).collect();
    at_least("differences other than 0", 1, nonzero.len())?;
    let (ranks, ties) = ranks(&nonzero.iter().map(|value| value.abs()).collect::<Vec<_>>());
    let sum =
        |sign: f64| nonzero.iter().zip(&ranks).filter(|(d, _)| **d * sign > 0.0).map(|(_, rank)| rank).sum::<f64>();
    let (above, below) = (sum(1.0), sum(-1.0));
    let statistic = above.min(below);
    let is_plain = nonzero.len() == differences.len() && ties.iter().all(|n| *n == 1.0);
    let p = if differences.len() <= if is_plain { 50 } else { 13 } {
        // Ranks of ties are halves.
        let sums = half_sums(&ranks.iter().map(|rank| (2.0 * rank) as usize).collect::<Vec<_>>());
        2.0 * sums.iter().take(1 + (2.0 * statistic) as usize).sum::<f64>()
    } else {
        let n = nonzero.len() as f64;
        let of_ties: f64 = ties.iter().map(|n| n.powi(3) - n).sum();
        let deviation = ((n * (n + 1.0) * (2.0 * n + 1.0) - of_ties / 2.0) / 24.0).sqrt();
        2.0 * Normal::standard().sf((above - n * (n + 1.0) / 4.0).abs() / deviation)
    };
    Ok(RankTest { statistic, p: p.min(1.0) })
}

/// Tests whether conditions differ, given for each participant one score of each condition (Friedman 1937, corrected
/// for ties). By the chi-squared distribution, which holds for more than ten participants.
pub fn friedman(blocks: &[Vec<f64>]) -> Result<RankTest, StatisticsError> {
    at_least("participants", 2, blocks.len())?;
    let k = blocks[0].len();
    at_least("conditions", 3, k)?;
    let mut sums = vec![0.0; k];
    let mut of_ties = 0.0;
    for block in blocks {
        finite("scores", block)?;
        if block.len() != k {
            return Err(StatisticsError::TooFew { what: "scores of a participant", least: k, found: block.len() });
        }
        let (ranks, ties) = ranks(block);
        sums.iter_mut().zip(ranks).for_each(|(sum, rank)| *sum += rank);
        of_ties += ties.iter().map(|n| n.powi(3) - n).sum::<f64>();
    }
    let (n, k) = (blocks.len() as f64, k as f64);
    let correction = 1.0 - of_ties / (n * k * (k * k - 1.0));
    if correction <= 0.0 {
        return Err(StatisticsError::NoSpread { what: "scores of every participant" });
    }
    let squares: f64 = sums.iter().map(|sum| sum * sum).sum();
    let statistic = (12.0 / (n * k * (k + 1.0)) * squares - 3.0 * n * (k + 1.0)) / correction;
    let distribution = ChiSquared::new(k - 1.0).map_err(|_| StatisticsError::NotFinite { what: "scores" })?;
    Ok(RankTest { statistic, p: distribution.sf(statistic.max(0.0)) })
}

/// Interval of the median of independent `values`: the narrowest symmetric pair of order statistics that covers the true
/// median with at least `confidence`, by the binomial distribution of the values below it (Hahn and Meeker 1991, section
/// 5.2). Exact for any continuous distribution, conservative where values tie. Six values are needed for 95 %.
pub fn median_interval(values: &[f64], confidence: f64) -> Result<ConfidenceInterval, StatisticsError> {
    let tail = tail(confidence)?;
    finite("values", values)?;
    let n = values.len();
    let too_few = |least| StatisticsError::TooFew { what: "values", least, found: n };
    let below = Binomial::new(0.5, n as u64).map_err(|_| too_few(1))?;
    // The interval leaves out `outside` values at each end: fewer than or as many lie below the median in a tail.
    let Some(outside) = (0..n.div_ceil(2)).take_while(|rank| below.cdf(*rank as u64) <= tail).last() else {
        return Err(too_few((-tail.log2()).ceil() as usize));
    };
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    Ok(ConfidenceInterval { low: sorted[outside], high: sorted[n - 1 - outside] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refusals() {
        assert!(matches!(signed_rank(&[0.0; 4]), Err(StatisticsError::TooFew { .. })));
        assert!(signed_rank(&[]).is_err() && signed_rank(&[1.0, f64::NAN]).is_err());
        assert_eq!(signed_rank(&[3.0]), Ok(RankTest { statistic: 0.0, p: 1.0 }));
        assert!(friedman(&[]).is_err() && friedman(&[vec![1.0, 2.0], vec![2.0, 1.0]]).is_err());
        assert!(friedman(&[vec![1.0, 2.0, 3.0], vec![1.0]]).is_err());
        assert!(matches!(friedman(&vec![vec![1.0; 3]; 5]), Err(StatisticsError::NoSpread { .. })));
    }

    #[test]
    fn six_values_are_needed() {
        let six = [3.0, 1.0, 6.0, 2.0, 5.0, 4.0];
        assert_eq!(median_interval(&six, 0.95), Ok(ConfidenceInterval { low: 1.0, high: 6.0 }));
        let few = Err(StatisticsError::TooFew { what: "values", least: 6, found: 5 });
        assert_eq!(median_interval(&six[..5], 0.95), few);
        assert!(median_interval(&[], 0.95).is_err() && median_interval(&[f64::NAN; 9], 0.95).is_err());
        assert_eq!(median_interval(&[2.0; 9], 0.95), Ok(ConfidenceInterval { low: 2.0, high: 2.0 }));
    }
}
