//! Tests of `orator_gesture::train::gan::recipe`.

use orator_base::text::length;
use orator_dataset::config::{
    AdversarialLoss, BoneLoss, GanConfig, GanRecipe, GanSettings, MotionRepresentation, NetworkPreset,
};
use orator_gesture::train::gan::recipe::{
    CHOICES, InitialWeights, REBOL2021, RECIPES, TrainingMaterial, mean_pose_warning, settings,
};

#[test]
fn short_speech_gives_a_warning_with_the_missing_minutes() {
    let warning =
        |train_secs: f64| mean_pose_warning(&TrainingMaterial { train_secs, validation_secs: 0.0, n_speakers: 1 });
    let text = warning(28.0).unwrap();
    assert!(text.contains("will be the mean pose") && text.contains("about 10 minutes"), "{text}");
    assert!(text.contains(&length(572.0)), "{text}");
    assert_eq!(warning(60.0), None);
}

pub(super) fn of_minutes(recipe: GanRecipe, minutes: f64) -> GanSettings {
    let material = TrainingMaterial { train_secs: 60.0 * minutes, validation_secs: 60.0, n_speakers: 1 };
    settings(&GanConfig { recipe, ..GanConfig::default() }, &material, InitialWeights::Random).unwrap()
}

/// Recorded hashes of the settings as JSON: `auto` for one speaker and for three speakers.
const GOLDEN: [&str; 2] = ["34dfe6e2091b5e2c", "15dbe717d7be6096"];

#[test]
fn settings_do_not_change() {
    let starts = [InitialWeights::Random, InitialWeights::AnotherSpeaker, InitialWeights::SeveralSpeakers];
    let mut hashes = Vec::new();
    for n_speakers in [1, 3] {
        let mut hasher = blake3::Hasher::new();
        for minutes in [0.0, 0.5, 2.0, 3.7, 5.0, 10.0, 17.3, 20.0, 30.0, 61.0, 90.0, 120.0, 400.0] {
            for initial in starts {
                let material = TrainingMaterial { train_secs: 60.0 * minutes, validation_secs: 0.0, n_speakers };
                let settings = settings(&GanConfig::default(), &material, initial).unwrap();
                let mut settings = orator_dataset::config::to_stored("gan", &settings).unwrap();
                let keys = settings.as_object_mut().unwrap();
                ["channels", "bone_loss", "words", "look_ahead_secs"]
                    .into_iter()
                    .for_each(|key| drop(keys.shift_remove(key)));
                hasher.update(settings.to_string().as_bytes());
            }
        }
        hashes.push(hasher.finalize().to_hex()[..16].to_owned());
    }
    assert_eq!(hashes, GOLDEN);
}

#[test]
fn columns_are_reproduced_and_interpolated() {
    let of = |minutes| of_minutes(GanRecipe::Auto, minutes);
    assert_eq!((of(0.1), of(10_000.0)), (of(2.0), of(120.0)));
    let (few, some, many) = (of(2.0), of(4.472), of(10.0));
    assert_eq!((few.steps, some.steps, many.steps), (450, 1_200, 2_000));
    assert_eq!((few.dropout, many.dropout, many.weight_decay), (0.5, 0.2, 2.0));
    assert!(few.dropout > some.dropout && some.dropout > many.dropout);
    for minutes in [0.5, 3.0, 5.0, 17.0, 60.0, 90.0] {
        let of = of(minutes);
        assert_eq!(of.steps % of.epoch_steps, 0, "{minutes} minutes end with a validation");
        assert!((of.rate(of.steps) - of.learning_rate * of.final_lr_ratio).abs() < 1e-12);
    }
}

/// `rebol2021` in numbers. Sources: [`REBOL2021`].
#[test]
fn rebol2021_sets_every_value() {
    let rebol = of_minutes(GanRecipe::Rebol2021, 10.0);
    let expected = GanSettings {
        recipe: GanRecipe::Rebol2021,
        preset: NetworkPreset::Paper,
        representation: MotionRepresentation::Positions,
        adversarial: AdversarialLoss::Minimax,
        bone_loss: BoneLoss::Metres,
        window_frames: 64,
        stride_frames: 5,
        batch: 32,
        steps: 90_000,
        epoch_steps: 300,
        learning_rate: 1e-4,
        final_lr_ratio: 1.0,
        lambda_l1: 1.0,
        lambda_gan: 1.0,
        lambda_bone: 0.1,
        augment_noise_db: -120.0,
        ..GanSettings::default()
    };
    assert_eq!(rebol, expected);
    assert_eq!((rebol.rate(0), rebol.rate(70_000)), (1e-4, 1e-4));
    // The table of sources names each key that the recipe sets, and no other.
    let mut keys: Vec<&str> = CHOICES.iter().map(|row| row.0).chain(RECIPES.iter().map(|row| row.key)).collect();
    let mut sourced: Vec<&str> = REBOL2021.iter().map(|row| row.0).collect();
    keys.sort_unstable();
    sourced.sort_unstable();
    assert_eq!(sourced, keys);
    // Explicit keys override the recipe.
    let requested = GanConfig {
        recipe: GanRecipe::Rebol2021,
        preset: NetworkPreset::Light,
        steps: 10.into(),
        ..GanConfig::default()
    };
    let material = TrainingMaterial { train_secs: 600.0, validation_secs: 60.0, n_speakers: 1 };
    let overridden = settings(&requested, &material, InitialWeights::Random).unwrap();
    assert_eq!(overridden, GanSettings { preset: NetworkPreset::Light, steps: 10, ..expected });
}

#[test]
fn shared_weights_may_be_frozen_only_after_training_on_several_speakers() {
    let material = TrainingMaterial { train_secs: 120.0, validation_secs: 60.0, n_speakers: 1 };
    let requested = GanConfig { shared_rate: 0.0.into(), ..GanConfig::default() };
    let rate = |initial| settings(&requested, &material, initial).unwrap().shared_rate;
    let starts = [InitialWeights::Random, InitialWeights::AnotherSpeaker, InitialWeights::SeveralSpeakers];
    assert_eq!(starts.map(rate), [1.0, 1.0, 0.0]);
}
