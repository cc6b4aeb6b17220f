//! `[seq2seq]`: training of the sequence-to-sequence networks. A [`Seq2seqConfig`] contains the settings as given, which
//! may be `"auto"`; in [`Seq2seqSettings`] the reading has filled in every value, and checkpoints store it.
//! `pipeline.toml` and the guide (`configuration`) document the keys.

use super::auto::{Auto, filled};
use super::choices::{ContinuityLoss, DistanceLoss, FineMotionReading, SeamState, SequenceNetwork, VarianceLoss};
use super::sections::auto_section;
use serde::{Deserialize, Serialize};
use serde_json::Value;

auto_section! {
    /// Keys of `[seq2seq]`; `N` and `C` are the types of the numbers and counts that a reading may choose.
    Seq2seqValues |number, count| {
        network: SequenceNetwork = SequenceNetwork::Contextual,
        reading: FineMotionReading = FineMotionReading::Auto,
        stride_frames: C = count => (0.0, 4096.0, "frames"),
        batch: C = count => (2.0, 4096.0, "segments"),
        epochs: C = count => (1.0, 1e6, "epochs"),
        steps: C = count => (1.0, 1e9, "steps"),
        learning_rate: N = number => (1e-9, 1.0, ""),
        #[serde(alias = "fade_from")]
        decay_start: usize = 0 => (0.0, 1e9, "steps"),
        distance: DistanceLoss = DistanceLoss::Auto,
        continuity: ContinuityLoss = ContinuityLoss::Auto,
        #[serde(alias = "reach")]
        variance_loss: VarianceLoss = VarianceLoss::Auto,
        lambda_continuity: f64 = 0.01 => (0.0, 1e4, ""),
        #[serde(alias = "lambda_reach")]
        lambda_variance: f64 = 1.0 => (0.0, 1e4, ""),
        lambda_adversarial: N = number => (0.0, 1e4, ""),
        words_around_secs: N = number => (0.0, 60.0, "s"),
        state_at_seams: SeamState = SeamState::Auto,
        scheduled_sampling: f64 = 1.0 => (0.0, 1.0, ""),
        #[serde(alias = "own_previous")]
        rollout_previous: f64 = 0.0 => (0.0, 1.0, ""),
        word_dropout: f64 = 0.0 => (0.0, 0.95, ""),
        hidden: usize = 150 => (1.0, 4096.0, "numbers"),
        #[serde(alias = "hears_context")]
        audio_context: bool = false,
        discriminator_blocks: usize = 2 => (2.0, 6.0, "blocks"),
        autoencoder_steps: C = count => (0.0, 1e9, "steps"),
        seed: u64 = 1337,
        epoch_steps: C = count => (1.0, 1e9, "steps"),
        patience: usize = 0,
        checkpoint_every: usize = 250 => (1.0, 1e9, "steps"),
        keep_checkpoints: usize = 3 => (1.0, 1e6, "checkpoints"),
    }
}

/// `[seq2seq]` as given, with values that may be `"auto"`.
pub type Seq2seqConfig = Seq2seqValues<Auto<f64>, Auto<usize>>;
/// `[seq2seq]` with all values filled in.
pub type Seq2seqSettings = Seq2seqValues<f64, usize>;

impl Default for Seq2seqConfig {
    fn default() -> Self {
        Self::with(Auto::Chosen, Auto::Chosen)
    }
}

/// Values of keys that are missing in a checkpoint of an earlier program version.
impl Default for Seq2seqSettings {
    fn default() -> Self {
        Self {
            reading: FineMotionReading::Code,
            distance: DistanceLoss::L1,
            continuity: ContinuityLoss::Numbers,
            variance_loss: VarianceLoss::Norm,
            state_at_seams: SeamState::Renewed,
            stride_frames: 0,
            batch: 50,
            epochs: 1,
            autoencoder_steps: 2_000,
            steps: 20_000,
            learning_rate: 1e-3,
            lambda_adversarial: 0.01,
            words_around_secs: 2.0,
            epoch_steps: 250,
            ..Self::with(0.0, 0)
        }
    }
}

impl Seq2seqConfig {
    /// Settings in which every `"auto"` is replaced by the value that `reading` returns for its key.
    ///
    /// # Errors
    /// An `"auto"` key for which there is no value, or a fraction for a count.
    pub fn filled(&self, reading: impl Fn(&str) -> Option<Value>) -> serde_json::Result<Seq2seqSettings> {
        filled(self, |key| reading(key).filter(|_| key != "reading"))
    }
}

impl Seq2seqSettings {
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
