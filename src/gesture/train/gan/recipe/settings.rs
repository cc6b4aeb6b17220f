//! Every number of a training, as it was asked for and as the recipe chose the rest. Checkpoints keep them.

use super::material::TrainingMaterial;
use super::start::TrainingStart;
use super::values::RecipeValues;
use orator_base::types::posture::PostureChannel;
use orator_dataset::config::{
    AdversarialLoss, ComputeDevice, GanConfig, GanRecipe, MotionRepresentation, NetworkPreset,
};
use serde::{Deserialize, Serialize};

/// Settings of a training; names, units and meaning of `[gan]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GanSettings {
    /// Checkpoints of versions without recipes have the defaults of `paper` where they say nothing.
    #[serde(default = "paper")]
    pub recipe: GanRecipe,
    pub preset: NetworkPreset,
    pub representation: MotionRepresentation,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub channels: Vec<PostureChannel>,
    pub window_frames: usize,
    pub stride_frames: usize,
    pub batch: usize,
    pub steps: usize,
    pub learning_rate: f64,
    #[serde(default = "one")]
    pub shared_rate: f64,
    #[serde(default)]
    pub warmup_steps: usize,
    #[serde(default = "one")]
    pub fade_to: f64,
    pub adversarial: AdversarialLoss,
    pub lambda_l1: f64,
    #[serde(default)]
    pub lambda_speed: f64,
    #[serde(default)]
    pub lambda_energy: f64,
    pub lambda_velocity: f64,
    pub lambda_gan: f64,
    pub lambda_bone: f64,
    #[serde(default)]
    pub adversarial_from: usize,
    #[serde(default)]
    pub adversarial_ramp: usize,
    #[serde(default)]
    pub ema_decay: f64,
    #[serde(default)]
    pub dropout: f64,
    #[serde(default)]
    pub weight_decay: f64,
    #[serde(default)]
    pub augment_speed: f64,
    #[serde(default)]
    pub augment_pitch: f64,
    #[serde(default)]
    pub augment_gain_db: f64,
    #[serde(default = "silence")]
    pub augment_noise_db: f64,
    #[serde(default)]
    pub augment_mask_bands: usize,
    #[serde(default)]
    pub augment_mask_secs: f64,
    #[serde(default)]
    pub augment_pose_noise: f64,
    #[serde(default)]
    pub augment_mirror: f64,
    pub seed: u64,
    pub epoch_steps: usize,
    pub patience: usize,
    pub checkpoint_every: usize,
    pub keep_checkpoints: usize,
    pub device: ComputeDevice,
}

fn paper() -> GanRecipe {
    GanRecipe::Paper
}

fn one() -> f64 {
    1.0
}

fn silence() -> f64 {
    -120.0
}

impl GanSettings {
    /// What was asked for, and what its recipe chooses for this much speech. The adversarial loss and the fade follow the
    /// number of steps that counts. `start`: what the training begins with.
    pub fn new(asked: &GanConfig, material: &TrainingMaterial, start: TrainingStart) -> Self {
        let values = RecipeValues::of(asked.recipe, material, start);
        let steps = asked.steps.or(values.steps as usize);
        let of_steps = |share: f64| (share * steps as f64).round() as usize;
        let epoch_steps = asked.epoch_steps.or(values.epoch_steps);
        Self {
            recipe: asked.recipe,
            preset: asked.preset,
            representation: asked.representation,
            channels: asked.channels.clone(),
            window_frames: asked.window_frames,
            stride_frames: asked.stride_frames,
            batch: asked.batch.or(values.batch),
            steps,
            learning_rate: asked.learning_rate.or(values.learning_rate),
            shared_rate: match start {
                TrainingStart::SeveralSpeakers => asked.shared_rate.or(values.shared_rate),
                // All weights are to be learnt; with 0 none would be.
                TrainingStart::Nothing | TrainingStart::AnotherSpeaker => 1.0,
            },
            warmup_steps: asked.warmup_steps.or(values.warmup_steps as usize),
            fade_to: asked.fade_to.or(values.fade_to),
            adversarial: asked.adversarial,
            lambda_l1: asked.lambda_l1,
            lambda_speed: asked.lambda_speed.or(values.lambda_speed),
            lambda_energy: asked.lambda_energy.or(values.lambda_energy),
            lambda_velocity: asked.lambda_velocity,
            lambda_gan: asked.lambda_gan.or(values.lambda_gan),
            lambda_bone: asked.lambda_bone,
            adversarial_from: asked.adversarial_from.or(of_steps(values.adversarial_from)),
            adversarial_ramp: asked.adversarial_ramp.or(of_steps(values.adversarial_ramp)),
            ema_decay: asked.ema_decay.or(values.ema_decay),
            dropout: asked.dropout.or(values.dropout),
            weight_decay: asked.weight_decay.or(values.weight_decay),
            augment_speed: asked.augment_speed.or(values.augment_speed),
            augment_pitch: asked.augment_pitch.or(values.augment_pitch),
            augment_gain_db: asked.augment_gain_db.or(values.augment_gain_db),
            augment_noise_db: asked.augment_noise_db.or(values.augment_noise_db),
            augment_mask_bands: asked.augment_mask_bands.or(values.augment_mask_bands.round() as usize),
            augment_mask_secs: asked.augment_mask_secs.or(values.augment_mask_secs),
            augment_pose_noise: asked.augment_pose_noise.or(values.augment_pose_noise),
            augment_mirror: asked.augment_mirror,
            seed: asked.seed,
            epoch_steps,
            patience: asked.patience.or(values.patience),
            checkpoint_every: asked.checkpoint_every,
            keep_checkpoints: asked.keep_checkpoints,
            device: asked.device,
        }
    }

    /// Learning rate of the step after `step` steps: it rises along a line, then falls along half a cosine.
    pub fn rate(&self, step: usize) -> f64 {
        let Self { learning_rate, warmup_steps, fade_to, steps, .. } = self;
        if step < *warmup_steps {
            return learning_rate * (step + 1) as f64 / (*warmup_steps + 1) as f64;
        }
        let n_fading = steps.saturating_sub(*warmup_steps).max(1);
        let share = ((step - warmup_steps) as f64 / n_fading as f64).min(1.0);
        let left = 0.5 * (1.0 + (std::f64::consts::PI * share).cos());
        learning_rate * (fade_to + (1.0 - fade_to) * left)
    }

    /// Weight of the adversarial loss of the step after `step` steps; 0: there is none.
    pub fn adversarial_weight(&self, step: usize) -> f64 {
        let Some(since) = step.checked_sub(self.adversarial_from) else { return 0.0 };
        let share = (since + 1) as f64 / (self.adversarial_ramp + 1) as f64;
        self.lambda_gan * share.min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(asked: GanConfig) -> GanSettings {
        GanSettings::new(
            &asked,
            &TrainingMaterial { train_secs: 600.0, validation_secs: 60.0, n_speakers: 1 },
            TrainingStart::Nothing,
        )
    }

    #[test]
    fn what_is_given_counts_and_the_rest_follows_the_steps() {
        let asked = GanConfig { steps: 400.into(), dropout: 0.0.into(), batch: 8.into(), ..GanConfig::default() };
        let of = settings(asked);
        assert_eq!((of.steps, of.dropout, of.batch), (400, 0.0, 8));
        assert!((of.rate(of.steps) - of.learning_rate * of.fade_to).abs() < 1e-12);
        let chosen = settings(GanConfig::default());
        assert!(chosen.steps > 400 && chosen.dropout > 0.0);
    }

    #[test]
    fn what_speakers_share_may_stand_still_only_where_it_has_been_learnt() {
        let asked = GanConfig { shared_rate: 0.0.into(), ..GanConfig::default() };
        let material = TrainingMaterial { train_secs: 120.0, validation_secs: 60.0, n_speakers: 1 };
        let rate = |start| GanSettings::new(&asked, &material, start).shared_rate;
        let starts = [TrainingStart::Nothing, TrainingStart::AnotherSpeaker, TrainingStart::SeveralSpeakers];
        assert_eq!(starts.map(rate), [1.0, 1.0, 0.0]);
    }

    #[test]
    fn the_rate_rises_along_a_line_and_falls_along_half_a_cosine() {
        let of = GanSettings {
            learning_rate: 1.0,
            warmup_steps: 9,
            fade_to: 0.1,
            steps: 109,
            ..settings(GanConfig::default())
        };
        assert_eq!((of.rate(0), of.rate(4), of.rate(9)), (0.1, 0.5, 1.0));
        assert!((of.rate(59) - 0.55).abs() < 1e-12 && (of.rate(109) - 0.1).abs() < 1e-12);
        assert!((of.rate(500) - 0.1).abs() < 1e-12, "a training that goes on behind its last step");
        let still = settings(GanConfig { recipe: GanRecipe::Paper, ..GanConfig::default() });
        assert_eq!((still.rate(0), still.rate(70_000)), (1e-4, 1e-4));
    }

    #[test]
    fn the_adversarial_loss_comes_when_it_is_told_to() {
        let of = GanSettings {
            lambda_gan: 0.5,
            adversarial_from: 100,
            adversarial_ramp: 9,
            ..settings(GanConfig::default())
        };
        let weights = [0, 99, 100, 104, 109, 1_000].map(|step| of.adversarial_weight(step));
        assert_eq!(weights, [0.0, 0.0, 0.05, 0.25, 0.5, 0.5]);
        let always = GanSettings { adversarial_from: 0, adversarial_ramp: 0, ..of };
        assert_eq!(always.adversarial_weight(0), 0.5);
    }

    #[test]
    fn settings_of_versions_without_recipes_are_read() {
        let mut stored =
            serde_json::to_value(settings(GanConfig { recipe: GanRecipe::Paper, ..GanConfig::default() })).unwrap();
        let written = stored.clone();
        for key in [
            "recipe",
            "shared_rate",
            "warmup_steps",
            "fade_to",
            "adversarial_from",
            "adversarial_ramp",
            "ema_decay",
            "dropout",
        ] {
            stored.as_object_mut().unwrap().remove(key);
        }
        let read: GanSettings = serde_json::from_value(stored).unwrap();
        assert_eq!(serde_json::to_value(read).unwrap(), written);
    }
}
