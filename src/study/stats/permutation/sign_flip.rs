//! Sign flips of independent scores: under the hypothesis each is as likely to be its negative (Fisher 1935). Of the
//! mean scores of participants less chance, or their differences between two conditions, that holds if they are
//! symmetric about 0 and participants are independent of each other; the clips count as given.

use super::super::error::{StatisticsError, at_least, finite};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

/// Largest factor tried to turn all scores into whole numbers.
const LARGEST_SCALE: u32 = 2520;
/// Largest sum of whole numbers, and most additions of probabilities.
const LARGEST_SUM: f64 = 1e6;
const MOST_ADDITIONS: f64 = 2e8;

/// Outcome of a test by sign flips.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FlipTest {
    /// Two-sided p value, of the sum's distance from 0.
    pub p: f64,
    /// Whether all flips were counted, not a sample of them.
    pub exact: bool,
}

/// Probability of each sum of a random half of whole numbers: every one of `sizes` is in it with probability 1/2.
pub(in super::super) fn half_sums(sizes: &[usize]) -> Vec<f64> {
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

/// Whole numbers in proportion to the magnitudes of `scores`, if a small factor gives such.
fn whole_numbers(scores: &[f64]) -> Option<Vec<usize>> {
    let is_whole = |value: f64| (value - value.round()).abs() < 1e-9 * value.abs().max(1.0);
    let scale = (1..=LARGEST_SCALE).map(f64::from).find(|scale| scores.iter().all(|score| is_whole(score * scale)))?;
    let total: f64 = scores.iter().map(|score| score.abs() * scale).sum();
    let fits = total <= LARGEST_SUM && total * scores.len() as f64 <= MOST_ADDITIONS;
    fits.then(|| scores.iter().map(|score| (score.abs() * scale).round() as usize).collect())
}

/// Tests whether `scores` are symmetric about 0. Counts all flips where the scores are multiples of a common unit, as
/// shares of right answers are; else `n_draws` random ones and the observed one (Phipson and Smyth 2010).
pub fn sign_flip(scores: &[f64], n_draws: usize, seed: u64) -> Result<FlipTest, StatisticsError> {
    at_least("scores", 1, scores.len())?;
    finite("scores", scores)?;
    if let Some(sizes) = whole_numbers(scores) {
        let above = scores.iter().zip(&sizes).filter(|(score, _)| **score > 0.0).map(|(_, size)| size).sum::<usize>();
        let total = sizes.iter().sum::<usize>();
        let far = |sum: usize| (2 * sum).abs_diff(total);
        let sums = half_sums(&sizes);
        let p: f64 = sums.iter().enumerate().filter(|(sum, _)| far(*sum) >= far(above)).map(|(_, p)| p).sum();
        return Ok(FlipTest { p: p.min(1.0), exact: true });
    }
    at_least("draws", 1, n_draws)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let total: f64 = scores.iter().map(|score| score.abs()).sum();
    let far = scores.iter().sum::<f64>().abs() - 1e-12 * total;
    let mut flipped = || scores.iter().map(|score| if rng.random() { *score } else { -score }).sum::<f64>();
    let n_far = (0..n_draws).filter(|_| flipped().abs() >= far).count();
    Ok(FlipTest { p: (1 + n_far) as f64 / (1 + n_draws) as f64, exact: false })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_scipy() {
        let golden: serde_json::Value =
            serde_json::from_str(include_str!("../../../../fixtures/reference/study_stats_golden.json")).unwrap();
        for case in golden["sign_flip"].as_array().unwrap() {
            let scores: Vec<f64> = serde_json::from_value(case["scores"].clone()).unwrap();
            let expected = case["p"].as_f64().unwrap();
            let test = sign_flip(&scores, 99_999, 1).unwrap();
            assert_eq!(test.exact, case["whole"].as_bool().unwrap());
            // Four standard deviations of 99,999 draws.
            let bound = if test.exact { 1e-12 } else { 4.0 * (expected * (1.0 - expected) / 1e5).sqrt() };
            assert!((test.p - expected).abs() <= bound, "{} {expected}", test.p);
        }
    }

    #[test]
    fn extremes() {
        assert_eq!(sign_flip(&[0.0; 5], 9, 1), Ok(FlipTest { p: 1.0, exact: true }));
        assert_eq!(sign_flip(&[0.35; 8], 9, 1), Ok(FlipTest { p: 2.0 / 256.0, exact: true }));
        // The observed flip counts too, so that no p value is 0.
        let unlikely: Vec<f64> = (1..60).map(|k| 1.0 + f64::from(k).sqrt()).collect();
        assert_eq!(sign_flip(&unlikely, 99, 1), Ok(FlipTest { p: 0.01, exact: false }));
        assert_eq!(sign_flip(&unlikely, 999, 7), sign_flip(&unlikely, 999, 7));
        assert!(sign_flip(&[], 9, 1).is_err() && sign_flip(&[f64::INFINITY], 9, 1).is_err());
        assert!(sign_flip(&unlikely, 0, 1).is_err());
        // Scores too large for a table are sampled.
        assert!(!sign_flip(&[1e300, -2.0, 5.0], 9, 1).unwrap().exact && !sign_flip(&[1e8], 9, 1).unwrap().exact);
    }
}
