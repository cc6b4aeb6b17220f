//! The numbers of the recipes. `paper` is one row: Rebol et al. 2021 and the code they built on (Ginosar et al. 2019).
//! `auto` is a table over the minutes of training speech.

use super::material::TrainingMaterial;
use super::start::TrainingStart;
use orator_dataset::config::GanRecipe;

/// What a recipe chooses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecipeValues {
    pub steps: f64,
    pub batch: usize,
    pub learning_rate: f64,
    pub shared_rate: f64,
    pub warmup_steps: f64,
    pub fade_to: f64,
    pub lambda_speed: f64,
    pub lambda_energy: f64,
    pub lambda_gan: f64,
    /// Step of the first adversarial loss and length of its ramp, as shares of the steps.
    pub adversarial_from: f64,
    pub adversarial_ramp: f64,
    pub ema_decay: f64,
    pub dropout: f64,
    pub weight_decay: f64,
    pub augment_speed: f64,
    pub augment_pitch: f64,
    pub augment_gain_db: f64,
    pub augment_noise_db: f64,
    pub augment_mask_bands: f64,
    pub augment_mask_secs: f64,
    pub augment_pose_noise: f64,
    pub epoch_steps: usize,
    pub patience: usize,
}

/// Rebol et al. 2021, after Ginosar et al. 2019: 300 epochs of 300 steps, weights of 1, nothing else.
pub const PAPER: RecipeValues = RecipeValues {
    steps: 90_000.0,
    batch: 32,
    learning_rate: 1e-4,
    shared_rate: 1.0,
    warmup_steps: 0.0,
    fade_to: 1.0,
    lambda_speed: 0.0,
    lambda_energy: 0.0,
    lambda_gan: 1.0,
    adversarial_from: 0.0,
    adversarial_ramp: 0.0,
    ema_decay: 0.0,
    dropout: 0.0,
    weight_decay: 0.0,
    augment_speed: 0.0,
    augment_pitch: 0.0,
    augment_gain_db: 0.0,
    augment_noise_db: -120.0,
    augment_mask_bands: 0.0,
    augment_mask_secs: 0.0,
    augment_pose_noise: 0.0,
    epoch_steps: 300,
    patience: 0,
};

/// Ten minutes of speech. Ten times the paper's rate, since there is no time for 90,000 steps. What keeps the network from
/// learning them by heart is the mean of the weights, the changes of the windows and, most of all, a strong decay (decoupled from
/// the gradient, Loshchilov & Hutter 2019). With 3 instead of 2, or half the channels dropped, or more hidden of the sound, it
/// does not always find the words that move a hand (22 examples each, `demo speaker --speech`); it finds them after a thousand
/// steps, with errors that rise before: hence the patience.
const TEN_MINUTES: RecipeValues = RecipeValues {
    steps: 2_000.0,
    batch: 32,
    learning_rate: 1e-3,
    shared_rate: 1.0,
    warmup_steps: 50.0,
    fade_to: 0.02,
    lambda_speed: 0.3,
    lambda_energy: 0.1,
    lambda_gan: 0.15,
    adversarial_from: 0.0,
    adversarial_ramp: 0.0,
    ema_decay: 0.99,
    dropout: 0.2,
    weight_decay: 2.0,
    augment_speed: 0.06,
    augment_pitch: 1.0,
    augment_gain_db: 4.0,
    augment_noise_db: -25.0,
    augment_mask_bands: 8.0,
    augment_mask_secs: 0.1,
    augment_pose_noise: 0.0,
    epoch_steps: 100,
    patience: 8,
};

/// Half an hour. With the decay, dropout and steps of ten minutes the words were not found.
const HALF_AN_HOUR: RecipeValues =
    RecipeValues { steps: 3_000.0, dropout: 0.1, weight_decay: 0.05, patience: 6, ..TEN_MINUTES };

/// Values at so many minutes of training speech, from few to many.
pub const AUTO: [(f64, RecipeValues); 4] = [
    (
        2.0,
        RecipeValues {
            steps: 450.0,
            lambda_gan: 0.05,
            ema_decay: 0.98,
            dropout: 0.5,
            weight_decay: 0.3,
            augment_speed: 0.1,
            augment_pitch: 2.0,
            augment_gain_db: 6.0,
            augment_noise_db: -15.0,
            augment_mask_bands: 16.0,
            augment_mask_secs: 0.25,
            epoch_steps: 50,
            patience: 5,
            ..TEN_MINUTES
        },
    ),
    (10.0, TEN_MINUTES),
    (30.0, HALF_AN_HOUR),
    (120.0, RecipeValues { steps: 4_500.0, lambda_energy: 0.2, patience: 4, ..HALF_AN_HOUR }),
];

/// A new speaker in a network of several. Its layer is one part in sixty of the weights, learnt within a hundred steps and hardly
/// by heart, so that little need be hidden of the sound, and the network has the others' energy already. PCK and
/// correlations of the wrists' speeds after two minutes: with the layer alone 76.1 %, .90 / .85; with 0.006 of the rate for the rest
/// 77.0 %, .89 / .86; with 0.017 76.5 %, .88 / .86; with all weights at one rate 72.5 %, .73 / .80.
const NEW_LAYER: RecipeValues = RecipeValues {
    steps: 200.0,
    learning_rate: 3e-3,
    shared_rate: 0.006,
    lambda_energy: 0.0,
    lambda_gan: 0.05,
    ema_decay: 0.98,
    epoch_steps: 25,
    patience: 4,
    ..TEN_MINUTES
};

/// Minutes of a new speaker up to which what others taught is not to be learnt anew: behind five others of sixty minutes each,
/// twenty of a seventh were learnt to PCK 78.1 % by the layer; alone 77.4 %.
const MOST_LAYER_MINUTES: f64 = 20.0;
/// Learning rate of a network all of which learns another speaker, as a share of one that knows nothing. Begun with a network
/// of five others that knew them by a vector each, two minutes of a sixth were learnt to PCK 74 % with 0.2, 70 % with 0.5.
const RATE_OF_A_START: f64 = 0.2;

impl RecipeValues {
    /// What `recipe` chooses for this much speech; `start`: what the network has learnt already.
    pub fn of(recipe: GanRecipe, material: &TrainingMaterial, start: TrainingStart) -> Self {
        let alone = auto(material.minutes());
        // Several are a start for others: behind five of twenty minutes each that had the decay of a hundred minutes, two of a new
        // one were learnt to PCK 75.2 %, with that of ten 76.9 %.
        let RecipeValues { dropout, weight_decay, .. } = if material.n_speakers > 1 { TEN_MINUTES } else { alone };
        let values = RecipeValues { dropout, weight_decay, ..alone };
        match (recipe, start) {
            (GanRecipe::Paper, _) => PAPER,
            (GanRecipe::Auto, TrainingStart::Nothing) => values,
            (GanRecipe::Auto, TrainingStart::SeveralSpeakers) if material.minutes() <= MOST_LAYER_MINUTES => NEW_LAYER,
            (GanRecipe::Auto, _) => RecipeValues { learning_rate: values.learning_rate * RATE_OF_A_START, ..values },
        }
    }
}

/// Values between the two rows of [`AUTO`] around `minutes`, linear in their logarithm; beyond the table its last row.
fn auto(minutes: f64) -> RecipeValues {
    let after = AUTO.iter().position(|(row, _)| *row >= minutes).unwrap_or(AUTO.len() - 1);
    let (low, high) = (&AUTO[after.saturating_sub(1)], &AUTO[after]);
    let share = if high.0 > low.0 { ((minutes / low.0).ln() / (high.0 / low.0).ln()).clamp(0.0, 1.0) } else { 0.0 };
    // From the row above, so that it is met to the last bit.
    let between = |of: fn(&RecipeValues) -> f64| of(&high.1) - (1.0 - share) * (of(&high.1) - of(&low.1));
    RecipeValues {
        // Whole epochs.
        steps: (between(|row| row.steps) / high.1.epoch_steps as f64).round() * high.1.epoch_steps as f64,
        learning_rate: between(|row| row.learning_rate),
        lambda_speed: between(|row| row.lambda_speed),
        lambda_energy: between(|row| row.lambda_energy),
        lambda_gan: between(|row| row.lambda_gan),
        ema_decay: between(|row| row.ema_decay),
        dropout: between(|row| row.dropout),
        weight_decay: between(|row| row.weight_decay),
        augment_speed: between(|row| row.augment_speed),
        augment_pitch: between(|row| row.augment_pitch),
        augment_gain_db: between(|row| row.augment_gain_db),
        augment_noise_db: between(|row| row.augment_noise_db),
        augment_mask_bands: between(|row| row.augment_mask_bands),
        augment_mask_secs: between(|row| row.augment_mask_secs),
        augment_pose_noise: between(|row| row.augment_pose_noise),
        ..high.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(minutes: f64) -> RecipeValues {
        auto(minutes)
    }

    #[test]
    fn rows_are_met_and_what_is_between_is_between() {
        for (minutes, row) in AUTO {
            assert_eq!(of(minutes), row, "{minutes} minutes");
        }
        assert_eq!((of(0.1), of(10_000.0)), (AUTO[0].1, AUTO[3].1));
        let (few, some, many) = (of(2.0), of(4.472), of(10.0));
        assert_eq!(some.steps, 1_200.0);
        assert!(few.dropout > some.dropout && some.dropout > many.dropout);
        for minutes in [0.5, 3.0, 5.0, 17.0, 60.0, 90.0] {
            let row = of(minutes);
            assert_eq!(row.steps % row.epoch_steps as f64, 0.0, "{minutes} minutes end with a validation");
        }
    }

    #[test]
    fn more_speech_is_learnt_longer_and_less_of_it_is_hidden() {
        for rows in AUTO.windows(2) {
            let [(_, few), (_, many)] = [rows[0], rows[1]];
            assert!(few.steps < many.steps && few.dropout >= many.dropout);
            assert!(few.augment_mask_bands >= many.augment_mask_bands && few.ema_decay <= many.ema_decay);
        }
    }

    #[test]
    fn the_papers_recipe_is_the_papers() {
        let material = TrainingMaterial { train_secs: 600.0, validation_secs: 60.0, n_speakers: 1 };
        let paper = RecipeValues::of(GanRecipe::Paper, &material, TrainingStart::Nothing);
        assert_eq!((paper.batch, paper.learning_rate, paper.lambda_gan, paper.steps), (32, 1e-4, 1.0, 90_000.0));
        assert_eq!((paper.fade_to, paper.ema_decay, paper.dropout, paper.weight_decay), (1.0, 0.0, 0.0, 0.0));
        assert_eq!((paper.augment_speed, paper.augment_mask_bands, paper.augment_noise_db), (0.0, 0.0, -120.0));
        let auto = |start| RecipeValues::of(GanRecipe::Auto, &material, start);
        let [alone, from_another] = [TrainingStart::Nothing, TrainingStart::AnotherSpeaker].map(auto);
        assert_eq!(from_another.learning_rate, RATE_OF_A_START * alone.learning_rate);
        assert_eq!(auto(TrainingStart::SeveralSpeakers), NEW_LAYER);
        let more = TrainingMaterial { train_secs: 1800.0, ..material };
        let of_more = RecipeValues::of(GanRecipe::Auto, &more, TrainingStart::SeveralSpeakers);
        let five = TrainingMaterial { train_secs: 6000.0, n_speakers: 5, ..material };
        let of_five = RecipeValues::of(GanRecipe::Auto, &five, TrainingStart::Nothing);
        let RecipeValues { dropout, weight_decay, .. } = of(10.0);
        assert_eq!(of_five, RecipeValues { dropout, weight_decay, ..of(100.0) });
        assert!(of_more.shared_rate == 1.0 && of_more.steps > NEW_LAYER.steps && of_more.learning_rate < 1e-3);
    }
}
