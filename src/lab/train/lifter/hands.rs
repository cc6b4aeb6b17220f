//! Training task of the hand lifter: synthetic hands in random orientations.

use crate::train::scene::hand::{errors, sample_hand};
use crate::train::supervised::TrainingTask;
use anyhow::Result;
use candle_core::{Device, Tensor};
use orator_base::motion::view::hand::{HandView, N_IN, N_OUT};
use orator_base::types::pose2d::N_HAND;
use orator_base::types::skeleton::Side;
use orator_nn::Mode;
use orator_nn::lifter::hand::{Config, HandLifter, KIND, NAME};
use orator_nn::params::Params;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// Number of evaluation hands.
const N_EVALUATED: usize = 4000;

/// Training task of the network.
pub struct HandLifterTask {
    params: Params,
    lifter: HandLifter,
}

impl HandLifterTask {
    /// Creates a network with layers of `hidden` units, on `device`, initialised from `seed`.
    ///
    /// # Errors
    /// A network that cannot be created.
    pub fn new(hidden: usize, seed: u64, device: &Device) -> Result<Self> {
        let mut params = Params::new(seed).on(device);
        let config = Config { n_in: N_IN, n_out: N_OUT, hidden, dropout: 0.0 };
        let lifter = HandLifter::new(&mut params, NAME, &config)?;
        Ok(Self { params, lifter })
    }
}

impl TrainingTask for HandLifterTask {
    fn kind(&self) -> &'static str {
        KIND
    }

    fn metadata(&self) -> Value {
        json!({ "config": self.lifter.config() })
    }

    fn params(&self) -> &Params {
        &self.params
    }

    fn shape_in(&self) -> Vec<usize> {
        vec![N_IN]
    }

    fn weights(&self) -> Vec<f32> {
        vec![1.0; N_HAND]
    }

    fn sample(&self, rng: &mut ChaCha8Rng, x: &mut [f32], y: &mut [f32]) {
        let (drawn, view) = loop {
            let drawn = sample_hand(rng);
            if let Some(view) = HandView::new(&drawn.seen, Side::Right) {
                break (drawn, view);
            }
        };
        x.copy_from_slice(&view.numbers);
        y.copy_from_slice(&view.target(&drawn.truth));
    }

    fn forward(&self, x: &Tensor, mode: &mut Mode) -> candle_core::Result<Tensor> {
        self.lifter.forward(x, mode)
    }

    fn errors(&self, brief: bool) -> Result<Vec<String>> {
        errors(|seen| Ok(self.lifter.lift(seen, Side::Right)?), N_EVALUATED, brief)
    }
}
