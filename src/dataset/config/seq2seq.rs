//! `[seq2seq]`: training of the sequence-to-sequence networks. `pipeline.toml` and the guide (`configuration`) document
//! the keys.

use super::choices::{ContinuityLoss, DistanceLoss, SequenceNetwork, VarianceLoss};
use super::sections::section;
use serde::{Deserialize, Serialize};

section! {
    /// `[seq2seq]`: the network, its losses and its training.
    Seq2seqConfig {
        network: SequenceNetwork = SequenceNetwork::Contextual,
        stride_frames: usize = 0 => (0.0, 4096.0, "frames"),
        batch: usize = 50 => (2.0, 4096.0, "segments"),
        steps: usize = 20_000 => (1.0, 1e9, "steps"),
        learning_rate: f64 = 1e-3 => (1e-9, 1.0, ""),
        #[serde(alias = "fade_from")]
        decay_start: usize = 0 => (0.0, 1e9, "steps"),
        distance: DistanceLoss = DistanceLoss::L1,
        continuity: ContinuityLoss = ContinuityLoss::Numbers,
        #[serde(alias = "reach")]
        variance_loss: VarianceLoss = VarianceLoss::Norm,
        lambda_continuity: f64 = 0.01 => (0.0, 1e4, ""),
        #[serde(alias = "lambda_reach")]
        lambda_variance: f64 = 1.0 => (0.0, 1e4, ""),
        lambda_adversarial: f64 = 0.01 => (0.0, 1e4, ""),
        words_around_secs: f64 = 2.0 => (0.0, 60.0, "s"),
        #[serde(alias = "own_previous")]
        rollout_previous: f64 = 0.0 => (0.0, 1.0, ""),
        word_dropout: f64 = 0.0 => (0.0, 0.95, ""),
        hidden: usize = 150 => (1.0, 4096.0, "numbers"),
        #[serde(alias = "hears_context")]
        audio_context: bool = false,
        autoencoder_steps: usize = 2_000 => (0.0, 1e9, "steps"),
        seed: u64 = 1337,
        epoch_steps: usize = 250 => (1.0, 1e9, "steps"),
        patience: usize = 0,
        checkpoint_every: usize = 250 => (1.0, 1e9, "steps"),
        keep_checkpoints: usize = 3 => (1.0, 1e6, "checkpoints"),
    }
}

impl Seq2seqConfig {
    /// Learning rate of a step (counted from 0): constant, then linear decay from step `decay_start` on; `decay_start` 0:
    /// no decay.
    pub fn rate(&self, step: usize) -> f64 {
        let Self { learning_rate, decay_start, steps, .. } = *self;
        if decay_start == 0 || step < decay_start || decay_start >= steps {
            return learning_rate;
        }
        learning_rate * (steps.saturating_sub(step).max(1) as f64 / (steps - decay_start) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_learning_rate_decays_linearly_from_a_step_on() {
        let settings = Seq2seqConfig { learning_rate: 1.0, decay_start: 6, steps: 10, ..Seq2seqConfig::default() };
        assert_eq!([0, 5, 6, 8, 9, 12].map(|step| settings.rate(step)), [1.0, 1.0, 1.0, 0.5, 0.25, 0.25]);
        assert_eq!(Seq2seqConfig::default().rate(19_999), 1e-3);
    }
}
