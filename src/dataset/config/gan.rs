//! `[gan]`: training of the speech-to-gesture network. A [`GanConfig`] contains the settings as given, in which numbers
//! may be `"auto"`; in a [`GanSettings`] a recipe has filled in every number, and checkpoints store it. `pipeline.toml`
//! and the guide (`configuration`) document the keys.

use super::auto::{Auto, filled};
use super::choices::{AdversarialLoss, BoneLoss, GanRecipe, MotionRepresentation, NetworkPreset};
use super::sections::auto_section;
use orator_base::types::posture::PostureChannel;
use serde::{Deserialize, Serialize};
use serde_json::Value;

auto_section! {
    /// Keys of `[gan]`; `N` and `C` are the types of the numbers and counts that a recipe may choose.
    GanValues |number, count| {
        recipe: GanRecipe = GanRecipe::Auto,
        preset: NetworkPreset = NetworkPreset::Auto,
        representation: MotionRepresentation = MotionRepresentation::Auto,
        channels: Vec<PostureChannel> = Vec::new(),
        words: bool = false,
        look_ahead_secs: f64 = 0.0 => (0.0, 2.0, "seconds"),
        window_frames: usize = 64 => (32.0, 4096.0, "frames"),
        stride_frames: usize = 5 => (1.0, 4096.0, "frames"),
        batch: C = count => (2.0, 4096.0, "windows"),
        steps: C = count => (1.0, 1e9, "steps"),
        learning_rate: N = number => (1e-9, 1.0, ""),
        shared_rate: N = number => (0.0, 1.0, ""),
        warmup_steps: C = count => (0.0, 1e9, "steps"),
        #[serde(alias = "fade_to")]
        final_lr_ratio: N = number => (0.0, 1.0, ""),
        adversarial: AdversarialLoss = AdversarialLoss::Auto,
        lambda_l1: f64 = 1.0 => (0.0, 1e4, ""),
        lambda_speed: N = number => (0.0, 1e4, ""),
        lambda_energy: N = number => (0.0, 1e4, ""),
        lambda_velocity: f64 = 0.0 => (0.0, 1e4, ""),
        lambda_gan: N = number => (0.0, 1e4, ""),
        lambda_bone: N = number => (0.0, 1e4, ""),
        bone_loss: BoneLoss = BoneLoss::Auto,
        adversarial_from: C = count => (0.0, 1e9, "steps"),
        adversarial_ramp: C = count => (0.0, 1e9, "steps"),
        ema_decay: N = number => (0.0, 0.999_999, ""),
        dropout: N = number => (0.0, 0.9, ""),
        weight_decay: N = number => (0.0, 10.0, ""),
        augment_speed: N = number => (0.0, 0.5, ""),
        augment_pitch: N = number => (0.0, 16.0, "bands"),
        augment_gain_db: N = number => (0.0, 40.0, "dB"),
        augment_noise_db: N = number => (-120.0, 20.0, "dB"),
        augment_mask_bands: C = count => (0.0, 32.0, "bands"),
        augment_mask_secs: N = number => (0.0, 2.0, "seconds"),
        augment_pose_noise: N = number => (0.0, 2.0, "deviations"),
        augment_mirror: f64 = 0.0 => (0.0, 1.0, ""),
        seed: u64 = 1337,
        epoch_steps: C = count => (1.0, 1e9, "steps"),
        patience: C = count => (0.0, 1e9, "epochs"),
        checkpoint_every: usize = 100 => (1.0, 1e9, "steps"),
        keep_checkpoints: usize = 3 => (1.0, 1e6, "checkpoints"),
    }
}

/// `[gan]` as given, with numbers that may be `"auto"`.
pub type GanConfig = GanValues<Auto<f64>, Auto<usize>>;
/// `[gan]` with all numbers filled in.
pub type GanSettings = GanValues<f64, usize>;

impl Default for GanConfig {
    fn default() -> Self {
        Self::with(Auto::Chosen, Auto::Chosen)
    }
}

/// Values of keys that are missing in a checkpoint of an earlier program version.
impl Default for GanSettings {
    fn default() -> Self {
        Self {
            recipe: GanRecipe::Rebol2021,
            preset: NetworkPreset::Light,
            representation: MotionRepresentation::Bones,
            adversarial: AdversarialLoss::LeastSquares,
            lambda_bone: 0.1,
            bone_loss: BoneLoss::Relative,
            shared_rate: 1.0,
            final_lr_ratio: 1.0,
            augment_noise_db: -120.0,
            ..Self::with(0.0, 0)
        }
    }
}

impl GanConfig {
    /// Settings in which every `"auto"` is replaced by the value of `recipe` for its key.
    ///
    /// # Errors
    /// An `"auto"` key for which the recipe has no value, or a fraction for a count.
    pub fn filled(&self, recipe: impl Fn(&str) -> Option<Value>) -> serde_json::Result<GanSettings> {
        filled(self, |key| recipe(key).filter(|_| key != "recipe"))
    }
}

impl GanSettings {
    /// Learning rate after `step` completed steps: linear warm-up, then cosine decay to `final_lr_ratio` times
    /// `learning_rate`.
    pub fn rate(&self, step: usize) -> f64 {
        let Self { learning_rate, warmup_steps, final_lr_ratio, steps, .. } = self;
        if step < *warmup_steps {
            return learning_rate * (step + 1) as f64 / (*warmup_steps + 1) as f64;
        }
        let n_decay_steps = steps.saturating_sub(*warmup_steps).max(1);
        let progress = ((step - warmup_steps) as f64 / n_decay_steps as f64).min(1.0);
        let cosine = 0.5 * (1.0 + (std::f64::consts::PI * progress).cos());
        learning_rate * (final_lr_ratio + (1.0 - final_lr_ratio) * cosine)
    }

    /// Weight of the adversarial loss after `step` completed steps: 0 before `adversarial_from`, then a linear ramp up
    /// to `lambda_gan`.
    pub fn adversarial_weight(&self, step: usize) -> f64 {
        let Some(since) = step.checked_sub(self.adversarial_from) else { return 0.0 };
        let share = (since + 1) as f64 / (self.adversarial_ramp + 1) as f64;
        self.lambda_gan * share.min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::number;
    use serde_json::json;

    #[test]
    fn the_rate_has_a_linear_warm_up_and_a_cosine_decay() {
        let base = GanSettings { learning_rate: 1.0, ..GanSettings::default() };
        let decaying = GanSettings { warmup_steps: 9, final_lr_ratio: 0.1, steps: 109, ..base.clone() };
        assert_eq!((decaying.rate(0), decaying.rate(4), decaying.rate(9)), (0.1, 0.5, 1.0));
        assert!((decaying.rate(59) - 0.55).abs() < 1e-12 && (decaying.rate(109) - 0.1).abs() < 1e-12);
        assert!((decaying.rate(500) - 0.1).abs() < 1e-12, "a training that goes on after its last step");
        assert_eq!((base.rate(0), base.rate(70_000)), (1.0, 1.0));
    }

    #[test]
    fn the_adversarial_loss_starts_at_its_step() {
        let always = GanSettings { lambda_gan: 0.5, ..GanSettings::default() };
        let ramped = GanSettings { adversarial_from: 100, adversarial_ramp: 9, ..always.clone() };
        let weights = [0, 99, 100, 104, 109, 1_000].map(|step| ramped.adversarial_weight(step));
        assert_eq!(weights, [0.0, 0.0, 0.05, 0.25, 0.5, 0.5]);
        assert_eq!(always.adversarial_weight(0), 0.5);
    }

    #[test]
    fn a_recipe_fills_in_only_missing_values() {
        let asked = GanConfig { steps: 400.into(), dropout: 0.0.into(), ..GanConfig::default() };
        let chosen = |key: &str| match key {
            "augment_noise_db" => json!(-0.5),
            "preset" => json!("paper"),
            "representation" | "adversarial" | "bone_loss" => json!("auto"),
            _ => number(7.0),
        };
        let filled = asked.filled(|key| Some(chosen(key))).unwrap();
        let expected = GanSettings {
            steps: 400,
            dropout: 0.0,
            augment_noise_db: -0.5,
            preset: NetworkPreset::Paper,
            ..GanSettings::with(7.0, 7)
        };
        assert_eq!(filled, expected);
        assert!(asked.filled(|_| None).is_err() && asked.filled(|_| Some(json!(0.5))).is_err());
    }
}
