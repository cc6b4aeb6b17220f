//! Tests by ranks: Wilcoxon's signed ranks of two paired conditions, Friedman's of several. Pairs and blocks are
//! participants, independent of each other.

use super::error::{StatisticsError, at_least, finite};
use super::permutation::sign_flip::half_sums;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

/// What becomes of differences of 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum ZeroDifferences {
    /// Left out (Wilcoxon 1945).
    Wilcox,
    /// Ranked with the others, then left out (Pratt 1959).
    Pratt,
}

/// Outcome of Wilcoxon's test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SignedRankTest {
    /// Smaller of the sums of ranks of positive and of negative differences.
    pub statistic: f64,
    /// Two-sided p value.
    pub p: f64,
    /// Whether all signs were counted; else by the normal distribution with correction for ties, without correction
    /// for continuity.
    pub exact: bool,
}

/// Outcome of Friedman's test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FriedmanTest {
    pub statistic: f64,
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

/// Tests whether paired `differences` are symmetric about 0. Exact for up to 50 differences without ties and zeros and
/// for up to 13 with them, as scipy's `wilcoxon` chooses.
pub fn signed_rank(differences: &[f64], zeros: ZeroDifferences) -> Result<SignedRankTest, StatisticsError> {
    finite("differences", differences)?;
    let n_zero = differences.iter().filter(|difference| **difference == 0.0).count();
    at_least("differences other than 0", 1, differences.len() - n_zero)?;
    let ranked: Vec<f64> =
        differences.iter().copied().filter(|value| zeros == ZeroDifferences::Pratt || *value != 0.0).collect();
    let (ranks, mut ties) = ranks(&ranked.iter().map(|value| value.abs()).collect::<Vec<_>>());
    let sum =
        |sign: f64| ranked.iter().zip(&ranks).filter(|(d, _)| **d * sign > 0.0).map(|(_, rank)| rank).sum::<f64>();
    let (above, below) = (sum(1.0), sum(-1.0));
    let statistic = above.min(below);
    let is_tied = ties.iter().any(|n| *n > 1.0);
    if differences.len() <= if is_tied || n_zero > 0 { 13 } else { 50 } {
        // Ranks of ties are halves.
        let nonzero = ranked.iter().zip(&ranks).filter(|(difference, _)| **difference != 0.0);
        let sums = half_sums(&nonzero.map(|(_, rank)| (2.0 * rank) as usize).collect::<Vec<_>>());
        let lower: f64 = sums.iter().take(1 + (2.0 * statistic) as usize).sum();
        return Ok(SignedRankTest { statistic, p: (2.0 * lower).min(1.0), exact: true });
    }
    let cubes = |n: f64| n * (n + 1.0) * (2.0 * n + 1.0);
    let n = ranked.len() as f64;
    // Zeros that were ranked are the lowest ranks; they carry no sign (Cureton 1967).
    let n_dropped = (ranked.len() + n_zero - differences.len()) as f64;
    if n_dropped > 0.0 {
        ties.remove(0);
    }
    let mean = (n * (n + 1.0) - n_dropped * (n_dropped + 1.0)) / 4.0;
    let of_ties: f64 = ties.iter().map(|n| n.powi(3) - n).sum();
    let deviation = ((cubes(n) - cubes(n_dropped) - of_ties / 2.0) / 24.0).sqrt();
    let p = 2.0 * Normal::standard().sf((above - mean).abs() / deviation);
    Ok(SignedRankTest { statistic, p: p.min(1.0), exact: false })
}

/// Tests whether conditions differ, given for each participant one score of each condition (Friedman 1937, corrected
/// for ties). By the chi-squared distribution, which holds for more than ten participants.
pub fn friedman(blocks: &[Vec<f64>]) -> Result<FriedmanTest, StatisticsError> {
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
    Ok(FriedmanTest { statistic, p: distribution.sf(statistic.max(0.0)) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_scipy() {
        let golden: serde_json::Value =
            serde_json::from_str(include_str!("../../../fixtures/reference/study_stats_golden.json")).unwrap();
        let near = |found: f64, expected: &serde_json::Value| {
            let expected = expected.as_f64().unwrap();
            assert!((found - expected).abs() <= 1e-9 * expected.abs(), "{found} {expected}");
        };
        for case in golden["wilcoxon"].as_array().unwrap() {
            let differences: Vec<f64> = serde_json::from_value(case["differences"].clone()).unwrap();
            for (zeros, name) in [(ZeroDifferences::Wilcox, "wilcox"), (ZeroDifferences::Pratt, "pratt")] {
                let test = signed_rank(&differences, zeros).unwrap();
                near(test.statistic, &case[name]["statistic"]);
                near(test.p, &case[name]["p"]);
            }
        }
        for case in golden["friedman"].as_array().unwrap() {
            let blocks: Vec<Vec<f64>> = serde_json::from_value(case["blocks"].clone()).unwrap();
            let test = friedman(&blocks).unwrap();
            near(test.statistic, &case["statistic"]);
            near(test.p, &case["p"]);
        }
    }

    #[test]
    fn refusals() {
        let zeros = [0.0; 4];
        assert!(matches!(signed_rank(&zeros, ZeroDifferences::Pratt), Err(StatisticsError::TooFew { .. })));
        assert!(signed_rank(&[], ZeroDifferences::Wilcox).is_err());
        assert!(signed_rank(&[1.0, f64::NAN], ZeroDifferences::Wilcox).is_err());
        let one = signed_rank(&[3.0], ZeroDifferences::Wilcox);
        assert_eq!(one, Ok(SignedRankTest { statistic: 0.0, p: 1.0, exact: true }));
        assert!(friedman(&[]).is_err() && friedman(&[vec![1.0, 2.0], vec![2.0, 1.0]]).is_err());
        assert!(friedman(&[vec![1.0, 2.0, 3.0], vec![1.0]]).is_err());
        assert!(matches!(friedman(&vec![vec![1.0; 3]; 5]), Err(StatisticsError::NoSpread { .. })));
    }
}
