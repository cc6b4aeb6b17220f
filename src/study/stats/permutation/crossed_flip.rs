//! Sign flips of whole groups of votes where participants and clips are both samples: a wild cluster bootstrap of the
//! studentised mean with the hypothesis imposed (MacKinnon, Nielsen and Webb 2021). Flips of participants alone would
//! leave out the error of clips; divided by its crossed standard error the mean has nearly one distribution with and
//! without it. Assumes deviations that are symmetric about the hypothesis; asymptotic, not exact.

use super::super::cluster::crossed::Contrast;
use super::super::cluster::votes::{ClipVote, VoteGroups};
use super::super::error::{StatisticsError, at_least, finite};
use super::sign_flip::FlipTest;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Tests whether the mean score is `expected` for other participants and other clips. Flips the scores less `expected`
/// of all votes of a participant or of a clip, of which there are fewer, in `n_draws` draws that each have their own
/// stream of random numbers.
pub fn crossed_sign_flip(
    votes: &[ClipVote],
    expected: f64,
    n_draws: usize,
    seed: u64,
) -> Result<FlipTest, StatisticsError> {
    at_least("draws", 1, n_draws)?;
    finite("expected scores", &[expected])?;
    let groups = VoteGroups::new(&[votes])?;
    at_least("participants", 2, groups.n[0])?;
    at_least("clips", 2, groups.n[1])?;
    let contrast = Contrast(vec![(0..votes.len(), 1.0)]);
    let statistic = |scores: &[f64]| {
        let mean = contrast.value(scores).abs();
        // Scores without any spread about a mean of 0 are as near as can be.
        if mean == 0.0 { 0.0 } else { mean / contrast.variance(&groups, scores).total().sqrt() }
    };
    let scores: Vec<f64> = votes.iter().map(|vote| vote.score - expected).collect();
    let observed = statistic(&scores) * (1.0 - 1e-12);
    let kind = usize::from(groups.n[1] < groups.n[0]);
    let is_far = |k: u64| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(k);
        let signs: Vec<f64> = (0..groups.n[kind]).map(|_| if rng.random() { 1.0 } else { -1.0 }).collect();
        let flipped: Vec<f64> = scores.iter().zip(&groups.of[kind]).map(|(s, group)| s * signs[*group]).collect();
        statistic(&flipped) >= observed
    };
    let n_far = (0..n_draws as u64).into_par_iter().filter(|k| is_far(*k)).count();
    Ok(FlipTest { p: (1 + n_far) as f64 / (1 + n_draws) as f64, exact: false })
}

#[cfg(test)]
mod tests {
    use super::super::super::cluster::crossed::crossed_estimate;
    use super::*;

    /// Votes of 30 participants on 12 clips, whose chance of success varies with the clip.
    fn votes(seed: u64, mean: f64) -> Vec<ClipVote> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let clips: Vec<f64> = (0..12).map(|_| mean - 0.2 + 0.4 * rng.random::<f64>()).collect();
        let pairs = (0..30).flat_map(|participant| (0..12).map(move |clip| (participant, clip)));
        let mut score = |clip: usize| f64::from(u8::from(rng.random::<f64>() < clips[clip]));
        pairs.map(|(participant, clip)| ClipVote { participant, clip, score: score(clip) }).collect()
    }

    #[test]
    fn p_values_are_near_those_of_the_t_distribution() {
        for seed in 0..6 {
            let votes = votes(seed, 0.56);
            let flipped = crossed_sign_flip(&votes, 0.5, 1999, 1).unwrap().p;
            let student = crossed_estimate(&votes).unwrap().p_value(0.5);
            assert!((flipped - student).abs() < 0.05 + 0.1 * student, "{flipped} {student}");
        }
    }

    #[test]
    fn threads_do_not_change_p() {
        let votes = votes(9, 0.5);
        let test = || crossed_sign_flip(&votes, 0.5, 99, 3).unwrap();
        assert_eq!(rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(test), test());
    }

    #[test]
    fn extremes() {
        let all: Vec<ClipVote> = votes(1, 0.5).into_iter().map(|vote| ClipVote { score: 1.0, ..vote }).collect();
        assert!(crossed_sign_flip(&all, 0.5, 999, 1).unwrap().p < 0.01);
        assert_eq!(crossed_sign_flip(&all, 1.0, 99, 1).unwrap().p, 1.0);
        assert!(crossed_sign_flip(&all[..12], 0.5, 99, 1).is_err() && crossed_sign_flip(&[], 0.5, 99, 1).is_err());
        assert!(crossed_sign_flip(&all, 0.5, 0, 1).is_err() && crossed_sign_flip(&all, f64::NAN, 9, 1).is_err());
    }
}
