//! `[seq2seq]`: training of the sequence-to-sequence networks. `pipeline.toml` and the guide (`configuration`) document the
//! keys.

use super::choices::{ContinuityLoss, DistanceLoss, ReachLoss, SequenceNetwork};
use serde::{Deserialize, Serialize};

/// `[seq2seq]`: the network, its losses and its training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Seq2seqConfig {
    pub network: SequenceNetwork,
    pub stride_frames: usize,
    pub batch: usize,
    pub steps: usize,
    pub learning_rate: f64,
    pub fade_from: usize,
    pub distance: DistanceLoss,
    pub continuity: ContinuityLoss,
    pub reach: ReachLoss,
    pub lambda_continuity: f64,
    pub lambda_reach: f64,
    pub lambda_adversarial: f64,
    pub words_around_secs: f64,
    pub own_previous: f64,
    pub word_dropout: f64,
    pub hidden: usize,
    pub hears_context: bool,
    pub autoencoder_steps: usize,
    pub seed: u64,
    pub epoch_steps: usize,
    pub patience: usize,
    pub checkpoint_every: usize,
    pub keep_checkpoints: usize,
}

impl Default for Seq2seqConfig {
    fn default() -> Self {
        Self {
            network: SequenceNetwork::Contextual,
            stride_frames: 0,
            batch: 50,
            steps: 20_000,
            learning_rate: 1e-3,
            fade_from: 0,
            distance: DistanceLoss::L1,
            continuity: ContinuityLoss::Numbers,
            reach: ReachLoss::Excursion,
            lambda_continuity: 0.01,
            lambda_reach: 1.0,
            lambda_adversarial: 0.01,
            words_around_secs: 2.0,
            own_previous: 0.0,
            word_dropout: 0.0,
            hidden: 150,
            hears_context: false,
            autoencoder_steps: 2_000,
            seed: 1337,
            epoch_steps: 250,
            patience: 0,
            checkpoint_every: 250,
            keep_checkpoints: 3,
        }
    }
}

impl Seq2seqConfig {
    /// Learning rate of a step, counted from 0.
    pub fn rate(&self, step: usize) -> f64 {
        let Self { learning_rate, fade_from, steps, .. } = *self;
        if fade_from == 0 || step < fade_from || fade_from >= steps {
            return learning_rate;
        }
        learning_rate * (steps.saturating_sub(step).max(1) as f64 / (steps - fade_from) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_learning_rate_falls_to_nothing_from_a_step_on() {
        let settings = Seq2seqConfig { learning_rate: 1.0, fade_from: 6, steps: 10, ..Seq2seqConfig::default() };
        assert_eq!([0, 5, 6, 8, 9, 12].map(|step| settings.rate(step)), [1.0, 1.0, 1.0, 0.5, 0.25, 0.25]);
        assert_eq!(Seq2seqConfig::default().rate(19_999), 1e-3);
    }
}
