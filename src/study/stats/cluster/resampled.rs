//! Two resampling methods for votes of which participants and clips are both samples. Bootstrap: both are drawn with
//! replacement, and a vote counts as often as its participant times its clip (pigeonhole bootstrap, Owen 2007); its draws
//! count the chance of single votes three times, so they are rescaled to the crossed standard error. Sign flips of all
//! votes of a participant or of a clip: a wild cluster bootstrap of the studentised mean (MacKinnon et al. 2021).

use super::super::error::{StatisticsError, at_least, finite};
use super::super::estimate::{ConfidenceInterval, StudentEstimate};
use super::crossed::Contrast;
use super::votes::{CLIP, ClipVote, PARTICIPANT, VoteGroups};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Groups of the votes; refuses fewer than two participants or clips, and no draws.
fn crossed_groups(votes: &[ClipVote], n_draws: usize) -> Result<VoteGroups, StatisticsError> {
    at_least("draws", 1, n_draws)?;
    let groups = VoteGroups::new(&[votes])?;
    at_least("participants", 2, groups.n[PARTICIPANT])?;
    at_least("clips", 2, groups.n[CLIP])?;
    Ok(groups)
}

/// Random numbers of a draw: each has its own stream, so results do not depend on the number of threads.
pub(in super::super) fn rng_of_draw(seed: u64, draw: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(draw);
    rng
}

/// Each of `n` things as often as it was drawn in `n` draws with replacement.
fn drawn(n: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut times = vec![0.0; n];
    (0..n).for_each(|_| times[rng.random_range(0..n as u64) as usize] += 1.0);
    times
}

/// Mean score in each of `n_draws` draws of participants and clips that contain a vote.
fn bootstrap_means(votes: &[ClipVote], n_draws: usize, seed: u64) -> Result<Vec<f64>, StatisticsError> {
    let groups = crossed_groups(votes, n_draws)?;
    let draw = |k: u64| {
        let mut rng = rng_of_draw(seed, k);
        let [participants, clips] = [PARTICIPANT, CLIP].map(|kind| drawn(groups.n[kind], &mut rng));
        let of_votes = groups.of[PARTICIPANT].iter().zip(&groups.of[CLIP]);
        let (n, sum) = votes.iter().zip(of_votes).fold((0.0, 0.0), |(n, sum), (vote, (participant, clip))| {
            let weight = participants[*participant] * clips[*clip];
            (n + weight, sum + weight * vote.score)
        });
        sum / n
    };
    let means: Vec<f64> = (0..n_draws as u64).into_par_iter().map(draw).collect();
    Ok(means.into_iter().filter(|mean| mean.is_finite()).collect())
}

/// Percentile interval (Efron 1979) of bootstrap means whose standard deviation was scaled to the standard error of the
/// crossed estimate of the same votes (after Rao and Wu 1988).
pub fn bootstrap_interval(
    votes: &[ClipVote],
    estimate: &StudentEstimate,
    confidence: f64,
    n_draws: usize,
    seed: u64,
) -> Result<ConfidenceInterval, StatisticsError> {
    let means = bootstrap_means(votes, n_draws, seed)?;
    let spread = StudentEstimate::of_mean(&means)?.standard_error * (means.len() as f64).sqrt();
    let scale = estimate.standard_error / spread;
    ConfidenceInterval::of_draws(means.iter().map(|mean| estimate.value + (mean - estimate.value) * scale), confidence)
}

/// Two-sided p value of the hypothesis that the mean score is `expected` for other participants and other clips. Flips
/// the scores less `expected` of all votes of a participant or of a clip, of which there are fewer. Flips of participants
/// alone would leave out the error of clips; divided by its crossed standard error the mean has nearly one distribution
/// with and without it. Assumes deviations that are symmetric about the hypothesis; asymptotic, not exact.
pub fn sign_flip_p(votes: &[ClipVote], expected: f64, n_draws: usize, seed: u64) -> Result<f64, StatisticsError> {
    finite("expected scores", &[expected])?;
    let groups = crossed_groups(votes, n_draws)?;
    let contrast = Contrast(vec![(0..votes.len(), 1.0)]);
    let statistic = |scores: &[f64]| {
        let mean = contrast.value(scores).abs();
        // Scores without any spread about a mean of 0 are as near as can be.
        if mean == 0.0 { 0.0 } else { mean / contrast.variance(&groups, scores).total().sqrt() }
    };
    let scores: Vec<f64> = votes.iter().map(|vote| vote.score - expected).collect();
    let observed = statistic(&scores) * (1.0 - 1e-12);
    let kind = if groups.n[CLIP] < groups.n[PARTICIPANT] { CLIP } else { PARTICIPANT };
    let is_far = |k: &u64| {
        let mut rng = rng_of_draw(seed, *k);
        let signs: Vec<f64> = (0..groups.n[kind]).map(|_| if rng.random() { 1.0 } else { -1.0 }).collect();
        let flipped: Vec<f64> = scores.iter().zip(&groups.of[kind]).map(|(s, group)| s * signs[*group]).collect();
        statistic(&flipped) >= observed
    };
    let n_far = (0..n_draws as u64).into_par_iter().filter(is_far).count();
    Ok((1 + n_far) as f64 / (1 + n_draws) as f64)
}

#[cfg(test)]
mod tests {
    use super::super::crossed::crossed_estimate;
    use super::*;
    use crate::simulate::{CrossedDesign, CrossedEffects, crossed_votes};

    fn votes(stream: u64, share: f64) -> Vec<ClipVote> {
        let design = CrossedDesign { n_participants: 30, n_trials: 20, n_clips: 20 };
        crossed_votes(&design, &CrossedEffects { share, sd_participants: 0.8, sd_clips: 0.8 }, 2, stream)
    }

    #[test]
    fn threads_change_nothing() {
        let votes = votes(1, 0.5);
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let means = |seed| bootstrap_means(&votes, 200, seed).unwrap();
        assert_eq!(means(5), alone.install(|| means(5)));
        assert_ne!(means(5), means(6));
        let p = || sign_flip_p(&votes, 0.5, 99, 3).unwrap();
        assert_eq!(p(), alone.install(p));
    }

    /// The variance over draws counts that of single votes about three times (Owen 2007), the rescaled draws once.
    #[test]
    fn draws_are_wider_than_the_crossed_error_until_rescaled() {
        let votes = votes(2, 0.5);
        let crossed = crossed_estimate(&votes).unwrap();
        let width = |interval: ConfidenceInterval| (interval.high - interval.low) / (3.92 * crossed.standard_error);
        let means = bootstrap_means(&votes, 2000, 1).unwrap();
        let plain = width(ConfidenceInterval::of_draws(means.iter().copied(), 0.95).unwrap());
        assert!((1.05..1.8).contains(&plain), "{plain}");
        let rescaled = width(bootstrap_interval(&votes, &crossed, 0.95, 2000, 1).unwrap());
        assert!((rescaled - 1.0).abs() < 0.06, "{rescaled}");
    }

    #[test]
    fn p_values_of_sign_flips_are_near_those_of_the_t_distribution() {
        for stream in 0..6 {
            let votes = votes(stream, 0.56);
            let flipped = sign_flip_p(&votes, 0.5, 1999, 1).unwrap();
            let student = crossed_estimate(&votes).unwrap().p_value(0.5);
            assert!((flipped - student).abs() < 0.05 + 0.1 * student, "{flipped} {student}");
        }
    }

    #[test]
    fn extremes_and_refusals() {
        let some = votes(4, 0.5);
        let crossed = crossed_estimate(&some).unwrap();
        let interval = |votes: &[ClipVote], n_draws| bootstrap_interval(votes, &crossed, 0.95, n_draws, 1);
        let all: Vec<ClipVote> = some.iter().map(|vote| ClipVote { score: 1.0, ..*vote }).collect();
        assert!(sign_flip_p(&all, 0.5, 999, 1).unwrap() < 0.01);
        assert_eq!(sign_flip_p(&all, 1.0, 99, 1), Ok(1.0));
        assert!(sign_flip_p(&all, f64::NAN, 9, 1).is_err());
        assert!(matches!(interval(&all, 9), Err(StatisticsError::NoSpread { .. })));
        for (votes, n_draws) in [(&some[..], 0), (&some[..20], 9), (&[], 9)] {
            assert!(interval(votes, n_draws).is_err() && sign_flip_p(votes, 0.5, n_draws, 1).is_err());
        }
    }
}
