//! The training of an adaptation: a fixed number of steps from the weights of the general lifter, and the reprojection
//! error on held-out keypoints before and after. The result depends on the arguments only, not on the number of threads.

use super::losses;
use super::samples::{KeypointStretch, LabelledWindows, LiftedStretch, OwnWindows};
use super::skeleton::{ArmLengths, arm_lengths, reprojection_error};
use crate::Mode;
use crate::lifter::body::BodyLifter;
use crate::lifter::temporal::Config;
use crate::optim::adam::{self, Adam};
use crate::params::Params;
use anyhow::{Context, Result};
use candle_core::{Device, Tensor};
use orator_base::motion::view::body::N_IN;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

/// Rounds after which the skeletons of the labelled windows and the bone lengths are measured again.
pub const ROUNDS: usize = 3;
/// Groups of windows per step, of each kind.
const GROUPS: usize = 6;
const LEARNING_RATE: f64 = 2e-4;
/// Least relative decrease of the held-out error.
const MIN_GAIN: f64 = 0.01;
/// Largest held-out error in metres after the adaptation: keypoints that no body with constant bone lengths explains
/// also allow a decrease, as random ones do (102 to 72 mm). Errors of real bodies are 9 to 20 mm.
const MAX_ERROR: f64 = 0.05;

/// Result of an adaptation.
pub struct AdaptedLifter {
    pub tensors: BTreeMap<String, Tensor>,
    /// Mean reprojection error of the held-out arm keypoints in metres, before and after.
    pub errors: [f64; 2],
}

impl AdaptedLifter {
    /// Whether the adapted network should be used.
    pub fn is_better(&self) -> bool {
        let [before, after] = self.errors;
        after < (1.0 - MIN_GAIN) * before && after <= MAX_ERROR
    }
}

/// Fine-tunes the network `base` on the keypoints `training` in `ROUNDS` rounds of `steps` steps. `on_step` is called
/// after each step.
///
/// # Errors
/// Weights that do not fit the configuration; no stretch with both shoulders.
pub fn adapt(
    config: &Config,
    base: &BTreeMap<String, Tensor>,
    [training, held_out]: [&[KeypointStretch]; 2],
    (steps, seed): (usize, u64),
    on_step: &dyn Fn(),
) -> Result<AdaptedLifter> {
    let mut params = Params::new(seed);
    let lifter = BodyLifter::new(&mut params, config)?;
    params.load(base)?;
    let window = config.receptive_field();
    let settings = adam::Config { amsgrad: true, max_norm: Some(1.0), ..adam::Config::default() };
    let mut adam = Adam::new(&params, settings)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let before = held_out_error(&lifter, training, held_out)?;
    for round in 0..ROUNDS {
        let lifted = LiftedStretch::all(&lifter, training)?;
        let lengths = lengths(&lifted)?;
        for step in 0..steps {
            let (mut own, mut labelled) = (OwnWindows::default(), LabelledWindows::default());
            for _ in 0..GROUPS {
                let mut any = || &lifted[rng.random_range(0..lifted.len())];
                let (first, second) = (any(), any());
                let drawn = own.draw(first, window, &mut rng);
                drawn.and_then(|()| labelled.draw(second, &lengths, window, &mut rng)).context(NO_BODY)?;
            }
            let numbers = [labelled.numbers.as_slice(), &own.numbers].concat();
            let n = numbers.len() / (N_IN * window);
            let x = Tensor::from_vec(numbers, (n, N_IN, window), &Device::Cpu)?;
            // With the running statistics, which a few hundred windows of one person must not replace.
            let output = lifter.net.forward(&x, &mut Mode::Eval)?;
            let of_labelled = losses::labelled(&output.narrow(0, 0, n / 2)?, &labelled)?;
            let loss = (of_labelled + losses::own(&output.narrow(0, n / 2, n / 2)?, &own, &lengths)?)?;
            let share = (round * steps + step) as f64 / (ROUNDS * steps) as f64;
            adam.step(&loss.backward()?, LEARNING_RATE * (0.5 + 0.5 * (std::f64::consts::PI * share).cos()))?;
            on_step();
        }
    }
    let after = held_out_error(&lifter, training, held_out)?;
    Ok(AdaptedLifter { tensors: params.tensors()?, errors: [before, after] })
}

const NO_BODY: &str = "no stretch of the keypoints shows both shoulders";

fn lengths(lifted: &[LiftedStretch]) -> Result<ArmLengths> {
    arm_lengths(lifted.iter().flat_map(|stretch| &stretch.poses)).context(NO_BODY)
}

/// Error of the held-out keypoints, with the bone lengths of the training keypoints; NaN if no body is held out.
fn held_out_error(lifter: &BodyLifter, training: &[KeypointStretch], held_out: &[KeypointStretch]) -> Result<f64> {
    let lengths = lengths(&LiftedStretch::all(lifter, training)?)?;
    Ok(reprojection_error(&LiftedStretch::all(lifter, held_out)?, &lengths))
}
