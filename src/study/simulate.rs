//! Simulated votes: participants and clips are drawn from populations with known effects. Used by the power analysis
//! and by tests of the analysis.

use super::stats::cluster::votes::ClipVote;
use super::stats::glmm::fit::{integrated, logistic};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde::Serialize;

/// Assignment of clips to participants. Each participant votes on `n_trials` consecutive clips (cyclically), so that
/// clips receive nearly equal numbers of votes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct CrossedDesign {
    pub n_participants: usize,
    pub n_trials: usize,
    pub n_clips: usize,
}

/// Distribution from which participants and clips are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CrossedEffects {
    /// Proportion of successes over all participants and clips, 0 to 1.
    pub share: f64,
    /// Standard deviation of the participants' random intercepts, log odds.
    pub sd_participants: f64,
    /// Standard deviation of the clips' random intercepts, log odds.
    pub sd_clips: f64,
}

impl CrossedEffects {
    /// Fixed intercept (log odds of a participant and clip with effect 0) that gives `share` as the marginal
    /// proportion, found by bisection.
    pub fn log_odds(&self) -> f64 {
        let sd = self.sd_participants.hypot(self.sd_clips);
        let (mut low, mut high) = (-50.0, 50.0);
        for _ in 0..80 {
            let middle = (low + high) / 2.0;
            if integrated(middle, sd).0 < self.share { low = middle } else { high = middle }
        }
        (low + high) / 2.0
    }
}

/// Votes of one simulated study; each `stream` of the seed is an independent study.
pub fn crossed_votes(design: &CrossedDesign, effects: &CrossedEffects, seed: u64, stream: u64) -> Vec<ClipVote> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    let mut draw =
        |n: usize, sd: f64| -> Vec<f64> { (0..n).map(|_| sd * rng.sample::<f64, _>(StandardNormal)).collect() };
    let participants = draw(design.n_participants, effects.sd_participants);
    let clips = draw(design.n_clips, effects.sd_clips);
    let mean = effects.log_odds();
    let assignments =
        (0..design.n_participants).flat_map(|participant| (0..design.n_trials).map(move |trial| (participant, trial)));
    let mut vote = |(participant, trial): (usize, usize)| {
        let clip = (participant * design.n_trials + trial) % design.n_clips.max(1);
        let is_success = rng.random::<f64>() < logistic(mean + participants[participant] + clips[clip]);
        ClipVote { participant, clip, score: f64::from(u8::from(is_success)) }
    };
    assignments.map(&mut vote).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn simulated_shares_and_balance_match_the_design() {
        let effects = CrossedEffects { share: 0.6, sd_participants: 0.5, sd_clips: 0.5 };
        assert!(effects.log_odds() > (0.6f64 / 0.4).ln());
        assert!(CrossedEffects { share: 0.5, ..effects }.log_odds().abs() < 1e-9);
        let design = CrossedDesign { n_participants: 2000, n_trials: 10, n_clips: 2000 };
        let votes = crossed_votes(&design, &effects, 1, 0);
        let share = votes.iter().map(|vote| vote.score).sum::<f64>() / votes.len() as f64;
        assert!((share - 0.6).abs() < 0.015, "{share}");
        let of_clip = |clip: usize| votes.iter().filter(|vote| vote.clip == clip).count();
        assert!((0..2000).all(|clip| of_clip(clip) == 10));
        assert_eq!(votes, crossed_votes(&design, &effects, 1, 0));
        assert_ne!(votes, crossed_votes(&design, &effects, 1, 1));
    }
}
