//! Recipes: what fills the keys of `[gan]` that are `"auto"`. `paper` is Rebol et al. 2021 and the code they built on (Ginosar
//! et al. 2019): 300 epochs of 300 steps, weights of 1, nothing else. `auto` follows the minutes of training speech.

use anyhow::{Context, Result};
use orator_dataset::config::{GanConfig, GanRecipe, GanSettings};
use orator_dataset::{Dataset, Split};

/// Speech of the datasets of a training.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainingMaterial {
    /// Seconds to train on, in intervals that hold a window.
    pub train_secs: f64,
    /// Seconds held out for validation, likewise.
    pub validation_secs: f64,
    /// Speakers, a dataset each; at least 1.
    pub n_speakers: usize,
}

/// What the network has learnt before the first step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrainingStart {
    Nothing,
    /// Another speaker's motion.
    AnotherSpeaker,
    /// What several speakers have in common; the layer of one new speaker (`SpeakerLayer`) is to be learnt.
    SeveralSpeakers,
}

impl TrainingMaterial {
    /// Seconds of datasets in intervals of `window_frames` at least.
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

/// Values of a key in each recipe.
struct RecipeRow {
    key: &'static str,
    paper: f64,
    /// Training of the layer of a new speaker in a network of several speakers.
    new_layer: f64,
    /// At the minutes of [`MINUTES`].
    auto: [f64; 4],
}

const fn row(key: &'static str, paper: f64, new_layer: f64, auto: [f64; 4]) -> RecipeRow {
    RecipeRow { key, paper, new_layer, auto }
}

/// Minutes of training speech at the columns of `auto`.
const MINUTES: [f64; 4] = [2.0, 10.0, 30.0, 120.0];

/// At ten minutes the rate is ten times the paper's, since there is no time for 90,000 steps. The mean of the weights, the
/// changes of the windows and, most of all, a strong decay (decoupled from the gradient, Loshchilov & Hutter 2019) keep the
/// network from overfitting. With a decay of 3, or half the channels dropped, or more of the sound hidden, it does not always
/// find the words that move a hand (22 examples each, `demo speaker --speech`); it finds them after a thousand steps, with
/// errors that rise before: hence the patience. At half an hour they were not found with the decay, dropout and steps of ten
/// minutes. The layer of a new speaker is one part in sixty of the weights, learnt within a hundred steps; the network has the
/// others' energy already. PCK and correlations of the wrists' speeds after two minutes: with the layer alone 76.1 %,
/// .90 / .85; with 0.006 of the rate for the rest 77.0 %, .89 / .86; with 0.017 76.5 %, .88 / .86; with one rate 72.5 %, .73 / .80.
#[rustfmt::skip]
const RECIPES: [RecipeRow; 23] = [
    //   key                  paper     new layer  auto: 2, 10, 30, 120 minutes
    row("steps",              90_000.0, 200.0,     [450.0, 2_000.0, 3_000.0, 4_500.0]),
    row("epoch_steps",        300.0,    25.0,      [50.0, 100.0, 100.0, 100.0]),
    row("patience",           0.0,      4.0,       [5.0, 8.0, 6.0, 4.0]),
    row("batch",              32.0,     32.0,      [32.0; 4]),
    row("learning_rate",      1e-4,     3e-3,      [1e-3; 4]),
    row("shared_rate",        1.0,      0.006,     [1.0; 4]),
    row("warmup_steps",       0.0,      50.0,      [50.0; 4]),
    row("fade_to",            1.0,      0.02,      [0.02; 4]),
    row("lambda_speed",       0.0,      0.3,       [0.3; 4]),
    row("lambda_energy",      0.0,      0.0,       [0.1, 0.1, 0.1, 0.2]),
    row("lambda_gan",         1.0,      0.05,      [0.05, 0.15, 0.15, 0.15]),
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

/// Keys against overfitting that follow ten minutes where several speakers are trained: after five of twenty minutes each with
/// the decay of a hundred minutes, two minutes of a new one were learnt to PCK 75.2 %, with that of ten 76.9 %.
const OF_TEN_MINUTES: [&str; 2] = ["dropout", "weight_decay"];
/// Minutes of a new speaker up to which the layer alone is learnt: after five others of sixty minutes each, twenty of a seventh
/// were learnt to PCK 78.1 % by the layer; alone 77.4 %.
const MOST_LAYER_MINUTES: f64 = 20.0;
/// Learning rate of a network all of which learns another speaker, as a share of that of a new network. After a network of five
/// others that knew them by a vector each, two minutes of a sixth were learnt to PCK 74 % with 0.2, 70 % with 0.5.
const RATE_OF_A_START: f64 = 0.2;

/// The settings of a training: `asked`, with what its recipe chooses for this much speech and this start.
///
/// # Errors
/// A key that the recipe does not know.
pub fn settings(asked: &GanConfig, material: &TrainingMaterial, start: TrainingStart) -> Result<GanSettings> {
    let minutes = material.train_secs / 60.0;
    let learns_layer = start == TrainingStart::SeveralSpeakers && minutes <= MOST_LAYER_MINUTES;
    let value = |row: &RecipeRow| match asked.recipe {
        GanRecipe::Paper => row.paper,
        GanRecipe::Auto if learns_layer => row.new_layer,
        GanRecipe::Auto if material.n_speakers > 1 && OF_TEN_MINUTES.contains(&row.key) => auto(row, 10.0),
        GanRecipe::Auto if start != TrainingStart::Nothing && row.key == "learning_rate" => {
            auto(row, minutes) * RATE_OF_A_START
        }
        GanRecipe::Auto => auto(row, minutes),
    };
    let settings = asked.filled(|key| RECIPES.iter().find(|row| row.key == key).map(value));
    let mut settings = settings.context("the recipe does not fit the keys of [gan]")?;
    if start != TrainingStart::SeveralSpeakers {
        // All weights are to be learnt; with 0 none would be.
        settings.shared_rate = 1.0;
    }
    Ok(settings)
}

/// Value of `auto` at so many minutes: between two columns linear in the logarithm of the minutes, beyond the table its last
/// column. Epochs and patience are those of the later column, and steps are a multiple of its epochs.
fn auto(row: &RecipeRow, minutes: f64) -> f64 {
    let after = MINUTES.iter().position(|column| *column >= minutes).unwrap_or(MINUTES.len() - 1);
    let before = after.saturating_sub(1);
    let [from, to] = [MINUTES[before], MINUTES[after]];
    let share = if to > from { ((minutes / from).ln() / (to / from).ln()).clamp(0.0, 1.0) } else { 0.0 };
    let [low, high] = [row.auto[before], row.auto[after]];
    // From the later column, so that it is met to the last bit.
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

/// Three lines on the settings of a training that begins; `secs_a_step`: time of a step on this machine, where it was measured.
///
/// # Errors
/// Settings that have no JSON form.
pub fn lines(of: &GanSettings, material: &TrainingMaterial, secs_a_step: Option<f64>) -> Result<Vec<String>> {
    let minutes = |secs: f64| format!("{:.1} min", secs / 60.0);
    let values = serde_json::to_value(of)?;
    let (train, held_out) = (minutes(material.train_secs), minutes(material.validation_secs));
    let whose = if material.n_speakers > 1 { format!(" of {} speakers", material.n_speakers) } else { String::new() };
    let time = secs_a_step.map(|secs| format!(", about {} here", minutes(secs * of.steps as f64))).unwrap_or_default();
    let end = match of.patience {
        0 => String::new(),
        epochs => format!("; it ends early after {epochs} validations without a better score"),
    };
    let numbers = RECIPES[4..].iter().filter_map(|row| Some((row.key, values[row.key].as_f64()?)));
    let numbers = numbers.map(|(key, value)| match value.abs() {
        0.0..1e-3 => format!("{key} {value}"),
        _ => format!("{key} {}", (value * 1e4).round() / 1e4),
    });
    Ok(vec![
        format!("recipe {} for {train} of speech{whose}, {held_out} held out", values["recipe"].as_str().unwrap_or("")),
        format!(
            "  {} steps of {} windows{time}, with a validation each {} steps{end}",
            of.steps, of.batch, of.epoch_steps
        ),
        format!("  {}", numbers.collect::<Vec<_>>().join(", ")),
    ])
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Settings of `recipe` for so many minutes of one speaker.
    pub(crate) fn of_minutes(recipe: GanRecipe, minutes: f64) -> GanSettings {
        let material = TrainingMaterial { train_secs: 60.0 * minutes, validation_secs: 60.0, n_speakers: 1 };
        settings(&GanConfig { recipe, ..GanConfig::default() }, &material, TrainingStart::Nothing).unwrap()
    }

    /// Hashes of the settings as JSON, recorded before recipes were a table: `auto` for one speaker and for three, `paper`.
    const GOLDEN: [&str; 3] = ["34dfe6e2091b5e2c", "15dbe717d7be6096", "ef3cdefcbf93b7b6"];

    #[test]
    fn settings_are_those_of_earlier_versions() {
        let starts = [TrainingStart::Nothing, TrainingStart::AnotherSpeaker, TrainingStart::SeveralSpeakers];
        let mut hashes = Vec::new();
        for (recipe, n_speakers) in [(GanRecipe::Auto, 1), (GanRecipe::Auto, 3), (GanRecipe::Paper, 1)] {
            let mut hasher = blake3::Hasher::new();
            for minutes in [0.0, 0.5, 2.0, 3.7, 5.0, 10.0, 17.3, 20.0, 30.0, 61.0, 90.0, 120.0, 400.0] {
                for start in starts {
                    let material = TrainingMaterial { train_secs: 60.0 * minutes, validation_secs: 0.0, n_speakers };
                    let asked = GanConfig { recipe, ..GanConfig::default() };
                    let mut settings = serde_json::to_value(settings(&asked, &material, start).unwrap()).unwrap();
                    settings.as_object_mut().unwrap().shift_remove("channels");
                    hasher.update(settings.to_string().as_bytes());
                }
            }
            hashes.push(hasher.finalize().to_hex()[..16].to_owned());
        }
        assert_eq!(hashes, GOLDEN);
    }

    #[test]
    fn rows_are_met_and_what_is_between_is_between() {
        let of = |minutes| of_minutes(GanRecipe::Auto, minutes);
        assert_eq!((of(0.1), of(10_000.0)), (of(2.0), of(120.0)));
        let (few, some, many) = (of(2.0), of(4.472), of(10.0));
        assert_eq!((few.steps, some.steps, many.steps), (450, 1_200, 2_000));
        assert_eq!((few.dropout, many.dropout, many.weight_decay), (0.5, 0.2, 2.0));
        assert!(few.dropout > some.dropout && some.dropout > many.dropout);
        for minutes in [0.5, 3.0, 5.0, 17.0, 60.0, 90.0] {
            let of = of(minutes);
            assert_eq!(of.steps % of.epoch_steps, 0, "{minutes} minutes end with a validation");
            assert!((of.rate(of.steps) - of.learning_rate * of.fade_to).abs() < 1e-12);
        }
    }

    #[test]
    fn the_papers_recipe_is_the_papers() {
        let paper = of_minutes(GanRecipe::Paper, 10.0);
        assert_eq!((paper.batch, paper.learning_rate, paper.lambda_gan, paper.steps), (32, 1e-4, 1.0, 90_000));
        assert_eq!((paper.rate(0), paper.rate(70_000)), (1e-4, 1e-4));
        // The defaults of checkpoints without recipes are the paper's too.
        let mut stored = serde_json::to_value(&paper).unwrap();
        let written = stored.clone();
        for key in ["recipe", "shared_rate", "warmup_steps", "fade_to", "adversarial_from", "ema_decay", "dropout"] {
            stored.as_object_mut().unwrap().remove(key);
        }
        let read: GanSettings = serde_json::from_value(stored).unwrap();
        assert_eq!(serde_json::to_value(read).unwrap(), written);
    }

    #[test]
    fn what_speakers_share_may_stand_still_only_where_it_has_been_learnt() {
        let material = TrainingMaterial { train_secs: 120.0, validation_secs: 60.0, n_speakers: 1 };
        let asked = GanConfig { shared_rate: 0.0.into(), ..GanConfig::default() };
        let rate = |start| settings(&asked, &material, start).unwrap().shared_rate;
        let starts = [TrainingStart::Nothing, TrainingStart::AnotherSpeaker, TrainingStart::SeveralSpeakers];
        assert_eq!(starts.map(rate), [1.0, 1.0, 0.0]);
    }
}
