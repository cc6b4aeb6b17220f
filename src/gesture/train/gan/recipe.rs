//! Recipes: values for the keys of `[gan]` that are `"auto"`. The recipe `rebol2021` is the system of Rebol et al. 2021:
//! what the paper does not state is taken from the code they built on (Ginosar et al. 2019); [`REBOL2021`] names the
//! source of each value. The recipe `auto` depends on the minutes of training speech.

use anyhow::{Context, Result};
use orator_base::text::{counted, length};
use orator_dataset::config::{GanConfig, GanRecipe, GanSettings, number};
use orator_dataset::{Dataset, Split};
use serde_json::Value;

/// Amount of speech in the datasets of a training.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainingMaterial {
    /// Seconds of the training split, in intervals of at least one window.
    pub train_secs: f64,
    /// Seconds of the validation split, in intervals of at least one window.
    pub validation_secs: f64,
    /// Number of speakers, one dataset each; at least 1.
    pub n_speakers: usize,
}

/// Weights of the network before the first step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InitialWeights {
    Random,
    /// Weights of a model of another speaker.
    AnotherSpeaker,
    /// Weights of a model of several speakers; only the layer of one new speaker (`SpeakerLayer`) has to be trained.
    SeveralSpeakers,
}

impl TrainingMaterial {
    /// Seconds of the datasets in intervals of at least `window_frames` frames.
    pub fn measure(datasets: &[&Dataset], window_frames: usize) -> Self {
        let of_dataset = |dataset: &Dataset, split: Split| -> f64 {
            let fps = dataset.info().fps;
            let samples = dataset.samples(split).into_iter();
            samples.filter(|sample| sample.n_frames >= window_frames).map(|sample| fps.secs(sample.n_frames)).sum()
        };
        let secs = |split: Split| datasets.iter().map(|dataset| of_dataset(dataset, split)).sum();
        Self {
            train_secs: secs(Split::Train),
            validation_secs: secs(Split::Validation),
            n_speakers: datasets.len().max(1),
        }
    }
}

/// Values of one key by recipe.
pub struct RecipeRow {
    pub key: &'static str,
    rebol: f64,
    /// Value for training the layer of a new speaker in a network of several speakers.
    new_layer: f64,
    /// Values at the minutes of [`MINUTES`].
    auto: [f64; 4],
}

const fn row(key: &'static str, rebol: f64, new_layer: f64, auto: [f64; 4]) -> RecipeRow {
    RecipeRow { key, rebol, new_layer, auto }
}

/// Minutes of training speech for the columns of `auto`.
const MINUTES: [f64; 4] = [2.0, 10.0, 30.0, 120.0];

/// `rebol` has the values of the recipe `rebol2021`. `auto` was chosen on synthetic speakers (see
/// `orator guide results`): its learning rate is ten times that of `rebol`, because it runs far fewer than 90,000 steps;
/// weight averaging, augmentation and decoupled weight decay (Loshchilov & Hutter 2019) prevent overfitting. The errors
/// may rise before the words are learned, hence the patience.
#[rustfmt::skip]
pub const RECIPES: [RecipeRow; 24] = [
    //   key                  rebol     new layer  auto: 2, 10, 30, 120 minutes
    row("steps",              90_000.0, 200.0,     [450.0, 2_000.0, 3_000.0, 4_500.0]),
    row("epoch_steps",        300.0,    25.0,      [50.0, 100.0, 100.0, 100.0]),
    row("patience",           0.0,      4.0,       [5.0, 8.0, 6.0, 4.0]),
    row("batch",              32.0,     32.0,      [32.0; 4]),
    row("learning_rate",      1e-4,     3e-3,      [1e-3; 4]),
    row("shared_rate",        1.0,      0.006,     [1.0; 4]),
    row("warmup_steps",       0.0,      50.0,      [50.0; 4]),
    row("final_lr_ratio",     1.0,      0.02,      [0.02; 4]),
    row("lambda_speed",       0.0,      0.3,       [0.3; 4]),
    row("lambda_energy",      0.0,      0.0,       [0.1, 0.1, 0.1, 0.2]),
    row("lambda_gan",         1.0,      0.05,      [0.05, 0.15, 0.15, 0.15]),
    row("lambda_bone",        0.1,      0.1,       [0.1; 4]),
    row("adversarial_from",   0.0,      0.0,       [0.0; 4]),
    row("adversarial_ramp",   0.0,      0.0,       [0.0; 4]),
    row("ema_decay",          0.0,      0.98,      [0.98, 0.99, 0.99, 0.99]),
    row("dropout",            0.0,      0.2,       [0.5, 0.2, 0.1, 0.1]),
    row("weight_decay",       0.0,      2.0,       [0.3, 2.0, 0.05, 0.05]),
    row("augment_speed",      0.0,      0.06,      [0.1, 0.06, 0.06, 0.06]),
    row("augment_pitch",      0.0,      1.0,       [2.0, 1.0, 1.0, 1.0]),
    row("augment_gain_db",    0.0,      4.0,       [6.0, 4.0, 4.0, 4.0]),
    row("augment_noise_db",   -120.0,   -25.0,     [-15.0, -25.0, -25.0, -25.0]),
    row("augment_mask_bands", 0.0,      8.0,       [16.0, 8.0, 8.0, 8.0]),
    row("augment_mask_secs",  0.0,      0.1,       [0.25, 0.1, 0.1, 0.1]),
    row("augment_pose_noise", 0.0,      0.0,       [0.0; 4]),
];

/// Keys with a fixed set of values: key, value in `rebol2021`, value in `auto`.
pub const CHOICES: [(&str, &str, &str); 4] = [
    ("preset", "paper", "light"),
    ("representation", "positions", "bones"),
    ("adversarial", "minimax", "least-squares"),
    ("bone_loss", "metres", "relative"),
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueSource {
    /// Stated in Rebol et al. 2021, with the section or equation.
    Paper(&'static str),
    /// Taken from the code of Ginosar et al. 2019 (speech2gesture), on which the system builds.
    Speech2gesture(&'static str),
    /// Neither states it.
    Unstated(&'static str),
}

/// Source of each value that the recipe `rebol2021` sets. `lambda_bone` lies in the range that the paper gives, (0, 1).
pub const REBOL2021: [(&str, ValueSource); 28] = [
    ("preset", ValueSource::Speech2gesture("2-D convolutions over mel spectrogram and time")),
    ("representation", ValueSource::Paper("eq. 1: 3-D positions of the joints")),
    ("adversarial", ValueSource::Paper("eq. 3")),
    ("bone_loss", ValueSource::Paper("eq. 1: 1-norm of the change of the bone lengths between consecutive frames")),
    ("steps", ValueSource::Speech2gesture("300 epochs of 300 steps")),
    ("epoch_steps", ValueSource::Speech2gesture("300 steps")),
    ("patience", ValueSource::Speech2gesture("no early stopping")),
    ("batch", ValueSource::Speech2gesture("32")),
    ("learning_rate", ValueSource::Speech2gesture("Adam, 1e-4 for both networks")),
    ("shared_rate", ValueSource::Speech2gesture("one model per speaker")),
    ("warmup_steps", ValueSource::Speech2gesture("constant learning rate")),
    ("final_lr_ratio", ValueSource::Speech2gesture("constant learning rate")),
    ("lambda_speed", ValueSource::Paper("eq. 4 has no such term")),
    ("lambda_energy", ValueSource::Paper("eq. 4 has no such term")),
    ("lambda_gan", ValueSource::Paper("eq. 4: weight 1")),
    ("lambda_bone", ValueSource::Unstated("eq. 1 gives the range (0, 1)")),
    ("adversarial_from", ValueSource::Speech2gesture("from the first step")),
    ("adversarial_ramp", ValueSource::Speech2gesture("from the first step")),
    ("ema_decay", ValueSource::Speech2gesture("no weight averaging")),
    ("dropout", ValueSource::Speech2gesture("none")),
    ("weight_decay", ValueSource::Speech2gesture("none")),
    ("augment_speed", ValueSource::Speech2gesture("no augmentation")),
    ("augment_pitch", ValueSource::Speech2gesture("no augmentation")),
    ("augment_gain_db", ValueSource::Speech2gesture("no augmentation")),
    ("augment_noise_db", ValueSource::Speech2gesture("no augmentation")),
    ("augment_mask_bands", ValueSource::Speech2gesture("no augmentation")),
    ("augment_mask_secs", ValueSource::Speech2gesture("no augmentation")),
    ("augment_pose_noise", ValueSource::Speech2gesture("no augmentation")),
];

/// Regularisation keys that have their 10 minute values if several speakers are trained, measured on new speakers.
const KEYS_OF_TEN_MINUTES: [&str; 2] = ["dropout", "weight_decay"];
/// Minutes of a new speaker up to which only the layer is trained, which is measured to be better there than a
/// network of its own.
const MAX_LAYER_MINUTES: f64 = 20.0;
/// Factor of the learning rate for fine-tuning all weights of another speaker's network, the better of two measured.
const FINE_TUNING_RATE: f64 = 0.2;

/// Settings of a training: `requested`, with the recipe's values for this amount of speech and these initial weights
/// filled in.
///
/// # Errors
/// An `"auto"` key that is missing in the recipe.
pub fn settings(requested: &GanConfig, material: &TrainingMaterial, initial: InitialWeights) -> Result<GanSettings> {
    let minutes = material.train_secs / 60.0;
    let is_layer_only = initial == InitialWeights::SeveralSpeakers && minutes <= MAX_LAYER_MINUTES;
    let value = |row: &RecipeRow| match requested.recipe {
        GanRecipe::Rebol2021 => row.rebol,
        GanRecipe::Auto if is_layer_only => row.new_layer,
        GanRecipe::Auto if material.n_speakers > 1 && KEYS_OF_TEN_MINUTES.contains(&row.key) => auto(row, 10.0),
        GanRecipe::Auto if initial != InitialWeights::Random && row.key == "learning_rate" => {
            auto(row, minutes) * FINE_TUNING_RATE
        }
        GanRecipe::Auto => auto(row, minutes),
    };
    let choice = |key: &str| {
        let (_, rebol, auto) = CHOICES.iter().find(|(of, ..)| *of == key)?;
        Some(Value::from(if requested.recipe == GanRecipe::Rebol2021 { *rebol } else { *auto }))
    };
    let settings = requested
        .filled(|key| choice(key).or_else(|| RECIPES.iter().find(|row| row.key == key).map(|row| number(value(row)))));
    let mut settings = settings.context("the recipe lacks a key of [gan]")?;
    if initial != InitialWeights::SeveralSpeakers {
        // All weights are trained here; a rate of 0 would freeze the network.
        settings.shared_rate = 1.0;
    }
    Ok(settings)
}

/// Value of `auto` for this many minutes: interpolated between the columns linearly in the logarithm of the minutes,
/// and clamped to the first and last column. Epoch steps and patience are those of the upper column; steps are rounded
/// to a multiple of its epoch steps.
fn auto(row: &RecipeRow, minutes: f64) -> f64 {
    let after = MINUTES.iter().position(|column| *column >= minutes).unwrap_or(MINUTES.len() - 1);
    let before = after.saturating_sub(1);
    let [from, to] = [MINUTES[before], MINUTES[after]];
    let share = if to > from { ((minutes / from).ln() / (to / from).ln()).clamp(0.0, 1.0) } else { 0.0 };
    let [low, high] = [row.auto[before], row.auto[after]];
    // Computed from the upper column, so that the columns are reproduced exactly.
    let between = high - (1.0 - share) * (high - low);
    match row.key {
        "epoch_steps" | "patience" => high,
        "steps" => {
            let epoch = RECIPES[1].auto[after];
            (between / epoch).round() * epoch
        }
        "augment_mask_bands" => between.round(),
        _ => between,
    }
}

/// Warning before a new network is trained on so little speech that it learns no more than the mean pose.
pub fn mean_pose_warning(material: &TrainingMaterial) -> Option<String> {
    const MIN_SECS: f64 = 60.0;
    (material.train_secs < MIN_SECS).then(|| {
        let missing = length(60.0 * MINUTES[1] - material.train_secs);
        format!(
            "warning: {} of speech to train on, the result will be the mean pose: motion that follows the speech needs \
             about {} minutes ({missing} more)",
            length(material.train_secs),
            MINUTES[1]
        )
    })
}

/// Three lines that describe the settings of a new training; `secs_a_step`: measured seconds per step on this machine.
pub fn lines(of: &GanSettings, material: &TrainingMaterial, secs_a_step: Option<f64>) -> Result<Vec<String>> {
    let values = serde_json::to_value(of)?;
    let (train, held_out) = (length(material.train_secs), length(material.validation_secs));
    let whose = if material.n_speakers > 1 { format!(" of {} speakers", material.n_speakers) } else { String::new() };
    let time = secs_a_step.map(|secs| format!(", about {}", length(secs * of.steps as f64))).unwrap_or_default();
    let end = match of.patience {
        0 => String::new(),
        epochs => format!("; stops early after {} without a better score", counted(epochs, "validation")),
    };
    let numbers = RECIPES[4..].iter().filter_map(|row| Some((row.key, values[row.key].as_f64()?)));
    let numbers = numbers.map(|(key, value)| {
        let scale = if value.abs() < 1e-3 { 1e6 } else { 1e4 };
        format!("{key} {}", (value * scale).round() / scale)
    });
    Ok(vec![
        format!(
            "recipe {}: {train} of speech to train on{whose}, {held_out} to validate on",
            values["recipe"].as_str().unwrap_or("")
        ),
        format!(
            "  {} of {} windows{time}, a validation every {}{end}",
            counted(of.steps, "step"),
            of.batch,
            counted(of.epoch_steps, "step")
        ),
        format!("  {}", numbers.collect::<Vec<_>>().join(", ")),
    ])
}
