//! Bootstrap of participants and clips at once: both are drawn with replacement, and a vote counts as often as its
//! participant times its clip (the pigeonhole bootstrap, Owen 2007). It counts the chance of single votes three times:
//! of 100 participants with 20 votes each on 40 clips, whose log odds vary by 0.3, its 95 % interval covers 99 %, and
//! `rescaled` to the crossed standard error 94 %.

use super::super::equivalence::Equivalence;
use super::super::error::{StatisticsError, at_least, tail, within};
use super::super::estimate::ConfidenceInterval;
use super::votes::{CLIP, ClipVote, PARTICIPANT, VoteGroups};
use orator_base::math::order::Ordered;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Means of the cells of a study in each of many draws of its participants and clips.
#[derive(Clone, Debug)]
pub struct CrossedBootstrap {
    means: Vec<f64>,
    /// One row for each draw, one mean for each cell; NaN where a draw has no vote of the cell.
    draws: Vec<Vec<f64>>,
}

/// Estimate with the values that other participants and clips might have given.
#[derive(Clone, Debug)]
pub struct BootstrapEstimate {
    pub value: f64,
    draws: Vec<f64>,
}

/// Each of `n` things as often as it was drawn in `n` draws with replacement.
fn drawn(n: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut times = vec![0.0; n];
    (0..n).for_each(|_| times[rng.random_range(0..n as u64) as usize] += 1.0);
    times
}

impl CrossedBootstrap {
    /// Draws participants and clips of all `cells` together `n_draws` times. Draw `k` has its own stream of random
    /// numbers, so that threads do not change a byte.
    pub fn new(cells: &[&[ClipVote]], n_draws: usize, seed: u64) -> Result<Self, StatisticsError> {
        at_least("cells", 1, cells.len())?;
        at_least("draws", 1, n_draws)?;
        let groups = VoteGroups::new(cells)?;
        at_least("participants", 2, groups.n[PARTICIPANT])?;
        at_least("clips", 2, groups.n[CLIP])?;
        let draw = |k: u64| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(k);
            let [participants, clips] = [PARTICIPANT, CLIP].map(|kind| drawn(groups.n[kind], &mut rng));
            let mut votes = groups.of[PARTICIPANT].iter().zip(&groups.of[CLIP]);
            let mean = |cell: &&[ClipVote]| {
                let weighted = cell.iter().zip(votes.by_ref());
                let (n, sum) = weighted.fold((0.0, 0.0), |(n, sum), (vote, (participant, clip))| {
                    let weight = participants[*participant] * clips[*clip];
                    (n + weight, sum + weight * vote.score)
                });
                sum / n
            };
            cells.iter().map(mean).collect()
        };
        let means = cells.iter().map(|votes| votes.iter().map(|vote| vote.score).sum::<f64>() / votes.len() as f64);
        Ok(Self { means: means.collect(), draws: (0..n_draws as u64).into_par_iter().map(draw).collect() })
    }

    /// Any function of the cells' means, such as one of them or the difference of two.
    pub fn estimate(&self, statistic: impl Fn(&[f64]) -> f64) -> BootstrapEstimate {
        let draws = self.draws.iter().map(|means| statistic(means)).filter(|draw| draw.is_finite()).collect();
        BootstrapEstimate { value: statistic(&self.means), draws }
    }
}

impl BootstrapEstimate {
    /// Draws with their distance from the value multiplied so that their standard deviation is `standard_error`, as
    /// of `crossed` (after Rao and Wu 1988).
    pub fn rescaled(&self, standard_error: f64) -> Result<Self, StatisticsError> {
        within("standard error", standard_error, 0.0..=f64::MAX)?;
        at_least("draws", 2, self.draws.len())?;
        let n = self.draws.len() as f64;
        let mean = self.draws.iter().sum::<f64>() / n;
        let spread = (self.draws.iter().map(|draw| (draw - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        if spread == 0.0 {
            return Err(StatisticsError::NoSpread { what: "draws" });
        }
        let draws = self.draws.iter().map(|draw| self.value + (draw - self.value) * standard_error / spread).collect();
        Ok(Self { value: self.value, draws })
    }

    /// Percentile interval (Efron 1979).
    pub fn interval(&self, confidence: f64) -> Result<ConfidenceInterval, StatisticsError> {
        let tail = tail(confidence)?;
        let sorted = Ordered::new(self.draws.iter().copied());
        let at = |share| sorted.quantile(share).ok_or(StatisticsError::TooFew { what: "draws", least: 1, found: 0 });
        Ok(ConfidenceInterval { low: at(tail)?, high: at(1.0 - tail)? })
    }

    /// Two one-sided tests whether the true value is less than `bound` away from `expected`: shares of draws beyond each
    /// bound, the observed value counted as one of them (Davison and Hinkley 1997, section 4.2).
    pub fn equivalence(&self, expected: f64, bound: f64) -> Result<Equivalence, StatisticsError> {
        within("bound", bound, f64::MIN_POSITIVE..=f64::MAX)?;
        let share = |is_beyond: &dyn Fn(f64) -> bool| {
            (1 + self.draws.iter().filter(|draw| is_beyond(**draw)).count()) as f64 / (1 + self.draws.len()) as f64
        };
        let p = share(&|draw| draw <= expected - bound).max(share(&|draw| draw >= expected + bound));
        Ok(Equivalence { bound, p, interval: self.interval(0.9)? })
    }
}

#[cfg(test)]
mod tests {
    use super::super::crossed::{crossed_difference, crossed_estimate};
    use super::*;

    /// Votes of 30 participants on 20 clips, with effects of both.
    fn votes(seed: u64) -> Vec<ClipVote> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let [participants, clips] = [30, 20].map(|n| (0..n).map(|_| rng.random::<f64>()).collect::<Vec<_>>());
        let pairs = (0..30).flat_map(|participant| (0..20).map(move |clip| (participant, clip)));
        let mut score =
            |p: usize, c: usize| f64::from(u8::from(rng.random::<f64>() * 3.0 < 0.5 + participants[p] + clips[c]));
        pairs.map(|(participant, clip)| ClipVote { participant, clip, score: score(participant, clip) }).collect()
    }

    #[test]
    fn threads_do_not_change_a_draw() {
        let votes = votes(1);
        let draws = || CrossedBootstrap::new(&[&votes], 200, 5).unwrap().draws;
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(draws);
        assert_eq!(draws(), alone);
        assert_ne!(CrossedBootstrap::new(&[&votes], 200, 6).unwrap().draws, alone);
    }

    /// The variance over draws counts that of single votes about three times (Owen 2007), the rescaled draws once.
    #[test]
    fn draws_are_wider_than_the_crossed_error_until_rescaled() {
        let (first, second) = (votes(2), votes(3));
        let bootstrap = CrossedBootstrap::new(&[&first, &second], 2000, 1).unwrap();
        for (draws, crossed) in [
            (bootstrap.estimate(|means| means[0]), crossed_estimate(&first).unwrap()),
            (bootstrap.estimate(|means| means[0] - means[1]), crossed_difference(&first, &second).unwrap()),
        ] {
            assert!((draws.value - crossed.value).abs() < 1e-12);
            let width = |estimate: &BootstrapEstimate| {
                let interval = estimate.interval(0.95).unwrap();
                (interval.high - interval.low) / (2.0 * 1.96 * crossed.standard_error)
            };
            assert!((1.05..1.8).contains(&width(&draws)), "{}", width(&draws));
            let rescaled = draws.rescaled(crossed.standard_error).unwrap();
            assert!((width(&rescaled) - 1.0).abs() < 0.06, "{}", width(&rescaled));
        }
        let share = bootstrap.estimate(|means| means[0]);
        let wide = share.equivalence(share.value, 0.5).unwrap();
        assert!((wide.p - 1.0 / 2001.0).abs() < 1e-12 && wide.passes());
        assert!(!share.equivalence(share.value, 0.001).unwrap().passes());
    }

    #[test]
    fn refusals() {
        let votes = votes(4);
        assert!(CrossedBootstrap::new(&[], 9, 1).is_err() && CrossedBootstrap::new(&[&[]], 9, 1).is_err());
        assert!(CrossedBootstrap::new(&[&votes], 0, 1).is_err());
        assert!(CrossedBootstrap::new(&[&votes[..20]], 9, 1).is_err(), "one participant");
        let bootstrap = CrossedBootstrap::new(&[&votes], 9, 1).unwrap();
        assert!(bootstrap.estimate(|_| f64::NAN).interval(0.95).is_err());
        assert!(bootstrap.estimate(|_| 1.0).rescaled(0.1).is_err());
        assert!(bootstrap.estimate(|means| means[0]).equivalence(0.5, 0.0).is_err());
    }
}
