//! Rank tests and order statistics: Wilcoxon's signed-rank test of two paired conditions, Friedman's test of several
//! (pairs and blocks are participants, assumed independent), a distribution-free interval of the median as reported by
//! the GENEA challenges (Kucherenko et al. 2021), and Krippendorff's alpha (Krippendorff 2011), the agreement of
//! raters: 1 for perfect agreement, 0 for chance.

use super::estimate::{ConfidenceInterval, StatisticsError, at_least, finite, tail};
use statrs::distribution::{Binomial, ChiSquared, ContinuousCDF, DiscreteCDF, Normal};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RankTest {
    /// Wilcoxon: the smaller of the rank sums of positive and negative differences. Friedman: chi-squared.
    pub statistic: f64,
    /// Two-sided p value.
    pub p: f64,
}

/// Ranks from 1, with mean ranks for ties, and the sizes of the groups of tied values.
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

/// Distribution of the sum of a random subset of `sizes`, each included with probability 1/2; indexed by the sum.
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

/// Tests whether paired `differences` are symmetric about 0 (Wilcoxon 1945); zero differences are dropped. Exact for up
/// to 50 differences without ties and zeros and for up to 13 with them, like scipy's `wilcoxon`; otherwise by the
/// normal approximation with tie correction, without continuity correction.
///
/// # Errors
/// A difference is not finite, or all differences are 0.
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
        // Tied ranks are multiples of one half, so they are doubled.
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

/// Tests whether conditions differ (Friedman 1937, with tie correction). Each block holds one participant's scores, one
/// per condition. The p value is from the chi-squared approximation, valid for more than ten participants.
///
/// # Errors
/// There are fewer than two participants or three conditions, a participant's number of scores differs, a score is not
/// finite, or every participant gives equal scores to all conditions.
pub fn friedman(blocks: &[Vec<f64>]) -> Result<RankTest, StatisticsError> {
    at_least("participants", 2, blocks.len())?;
    let k = blocks[0].len();
    at_least("conditions", 3, k)?;
    let mut sums = vec![0.0; k];
    let mut of_ties = 0.0;
    for block in blocks {
        finite("scores", block)?;
        if block.len() != k {
            return Err(StatisticsError::TooFew { what: "scores of a participant", min: k, found: block.len() });
        }
        let (ranks, ties) = ranks(block);
        sums.iter_mut().zip(ranks).for_each(|(sum, rank)| *sum += rank);
        of_ties += ties.iter().map(|n| n.powi(3) - n).sum::<f64>();
    }
    let (n, k) = (blocks.len() as f64, k as f64);
    let correction = 1.0 - of_ties / (n * k * (k * k - 1.0));
    if correction <= 0.0 {
        return Err(StatisticsError::NoVariation { what: "scores of every participant" });
    }
    let squares: f64 = sums.iter().map(|sum| sum * sum).sum();
    let statistic = (12.0 / (n * k * (k + 1.0)) * squares - 3.0 * n * (k + 1.0)) / correction;
    let distribution = ChiSquared::new(k - 1.0).map_err(|_| StatisticsError::NotFinite { what: "scores" })?;
    Ok(RankTest { statistic, p: distribution.sf(statistic.max(0.0)) })
}

/// Interval of the median of independent `values`: the narrowest symmetric pair of order statistics that covers the
/// true median with at least `confidence`, by the binomial distribution of the values below it (Hahn and Meeker 1991,
/// section 5.2). Exact for continuous distributions, conservative with ties. 95 % needs at least six values.
///
/// # Errors
/// There are too few values for `confidence`, a value is not finite, or `confidence` is not between 0 and 1.
pub fn median_interval(values: &[f64], confidence: f64) -> Result<ConfidenceInterval, StatisticsError> {
    let tail = tail(confidence)?;
    finite("values", values)?;
    let n = values.len();
    let too_few = |min| StatisticsError::TooFew { what: "values", min, found: n };
    let below = Binomial::new(0.5, n as u64).map_err(|_| too_few(1))?;
    // `outside` values are excluded at each end: the largest rank whose cumulative probability is within the tail.
    let Some(outside) = (0..n.div_ceil(2)).take_while(|rank| below.cdf(*rank as u64) <= tail).last() else {
        return Err(too_few((-tail.log2()).ceil() as usize));
    };
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    Ok(ConfidenceInterval { low: sorted[outside], high: sorted[n - 1 - outside] })
}

/// Scale of measurement, which determines the distance of two ratings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeasurementScale {
    Nominal,
    Ordinal,
    Interval,
}

/// Krippendorff's alpha of `units`, each with its ratings. Units with fewer than two ratings are ignored.
///
/// # Errors
/// No unit has two ratings, a rating is not finite, or all ratings are equal.
pub fn alpha(units: &[Vec<f64>], scale: MeasurementScale) -> Result<f64, StatisticsError> {
    let rated: Vec<&Vec<f64>> = units.iter().filter(|unit| unit.len() > 1).collect();
    at_least("units with two ratings", 1, rated.len())?;
    // Adding 0 turns -0 into 0.
    let mut values: Vec<f64> = rated.iter().flat_map(|unit| unit.iter().map(|value| value + 0.0)).collect();
    finite("ratings", &values)?;
    values.sort_unstable_by(f64::total_cmp);
    values.dedup();
    let count = |unit: &Vec<f64>, value: &f64| unit.iter().filter(|rating| *rating == value).count() as f64;
    let counts: Vec<Vec<f64>> =
        rated.iter().map(|unit| values.iter().map(|value| count(unit, value)).collect()).collect();
    let totals: Vec<f64> = (0..values.len()).map(|value| counts.iter().map(|unit| unit[value]).sum()).collect();
    let distance = squared_distances(scale, values, &totals);
    let disagreement = |counts: &[f64]| -> f64 {
        let present: Vec<usize> = (0..counts.len()).filter(|value| counts[*value] > 0.0).collect();
        let row = |a: &usize| present.iter().map(|b| counts[*a] * counts[*b] * distance(*a, *b)).sum::<f64>();
        present.iter().map(row).sum()
    };
    let observed: f64 = counts.iter().map(|unit| disagreement(unit) / (unit.iter().sum::<f64>() - 1.0)).sum();
    let expected = disagreement(&totals) / (totals.iter().sum::<f64>() - 1.0);
    if expected > 0.0 { Ok(1.0 - observed / expected) } else { Err(StatisticsError::NoVariation { what: "ratings" }) }
}

/// Squared distance between two of the ascending `values`, given by index; `totals` holds the frequency of each value.
fn squared_distances(scale: MeasurementScale, values: Vec<f64>, totals: &[f64]) -> impl Fn(usize, usize) -> f64 {
    let mut before = 0.0;
    // Ordinal scale: number of ratings below a value plus half of those equal to it.
    let middle = |total: &f64| {
        before += total;
        before - total / 2.0
    };
    let positions = if scale == MeasurementScale::Ordinal { totals.iter().map(middle).collect() } else { values };
    move |a, b| match scale {
        MeasurementScale::Nominal => f64::from(u8::from(a != b)),
        _ => (positions[a] - positions[b]).powi(2),
    }
}
