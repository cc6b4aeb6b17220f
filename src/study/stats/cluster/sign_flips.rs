//! Sign flips of whole groups of votes where participants and clips are both samples: a wild cluster bootstrap of the
//! studentised mean with the hypothesis imposed (MacKinnon et al. 2021). Flips of participants alone would leave out the
//! error of clips; divided by its crossed standard error the mean has nearly one distribution with and without it. Assumes
//! deviations that are symmetric about the hypothesis; asymptotic, not exact.

use super::super::estimate::{StatisticsError, at_least, finite};
use super::crossed::Contrast;
use super::votes::{CLIP, ClipVote, PARTICIPANT, VoteGroups};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Random numbers of a draw: each has its own stream, so results do not depend on the number of threads.
pub(in super::super) fn rng_of_draw(seed: u64, draw: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(draw);
    rng
}

/// Two-sided p value of the hypothesis that the mean score is `expected` for other participants and other clips. Flips
/// the scores less `expected` of all votes of a participant or of a clip, of which there are fewer.
pub fn sign_flip_p(votes: &[ClipVote], expected: f64, n_draws: usize, seed: u64) -> Result<f64, StatisticsError> {
    finite("expected scores", &[expected])?;
    at_least("draws", 1, n_draws)?;
    let groups = VoteGroups::new(&[votes])?;
    at_least("participants", 2, groups.n[PARTICIPANT])?;
    at_least("clips", 2, groups.n[CLIP])?;
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
        let (votes, alone) = (votes(1, 0.5), rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap());
        let p = || sign_flip_p(&votes, 0.5, 99, 3).unwrap();
        assert_eq!(p(), alone.install(p));
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
        let all: Vec<ClipVote> = votes(4, 0.5).iter().map(|vote| ClipVote { score: 1.0, ..*vote }).collect();
        assert!(sign_flip_p(&all, 0.5, 999, 1).unwrap() < 0.01);
        assert_eq!(sign_flip_p(&all, 1.0, 99, 1), Ok(1.0));
        for (votes, expected, n_draws) in [(&all[..], 0.5, 0), (&all[..20], 0.5, 9), (&[], 0.5, 9), (&all, f64::NAN, 9)]
        {
            assert!(sign_flip_p(votes, expected, n_draws, 1).is_err());
        }
    }
}
