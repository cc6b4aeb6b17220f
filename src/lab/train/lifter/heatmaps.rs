//! Training task of the heat-map lifter (Zimmermann & Brox 2017): score maps of synthetic hands to the hand in its
//! canonical frame and the rotation of that frame. The hands are those of the coordinate network's training, all of
//! them right ones.

use crate::train::scene::hand::{errors, sample_hand};
use crate::train::scene::hand_shape::normal;
use crate::train::supervised::TrainingTask;
use anyhow::Result;
use candle_core::{Device, Tensor};
use orator_base::types::pose2d::N_HAND;
use orator_base::types::skeleton::Side;
use orator_nn::Mode;
use orator_nn::lifter::heatmap_network::{HeatmapLifter, KIND, NAME, right_sides};
use orator_nn::lifter::score_maps::{Crop, MAP_SIZE, canonical, score_maps};
use orator_nn::params::Params;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// Output rows of three numbers: the points, then the rows of the rotation matrix.
const N_ROWS: usize = N_HAND + 3;

/// Number of evaluation hands; few, because the network is slow.
const N_EVALUATED: usize = 300;

/// Training task of the network.
pub struct HeatmapLifterTask {
    params: Params,
    lifter: HeatmapLifter,
}

impl HeatmapLifterTask {
    /// Creates the networks on `device`, initialised from `seed`.
    ///
    /// # Errors
    /// A network that cannot be created.
    pub fn new(seed: u64, device: &Device) -> Result<Self> {
        let mut params = Params::new(seed).on(device);
        let lifter = HeatmapLifter::new(&mut params, NAME)?;
        Ok(Self { params, lifter })
    }
}

impl TrainingTask for HeatmapLifterTask {
    fn kind(&self) -> &'static str {
        KIND
    }

    fn metadata(&self) -> Value {
        json!({ "config": { "places": MAP_SIZE, "points": N_HAND } })
    }

    fn params(&self) -> &Params {
        &self.params
    }

    fn shape_in(&self) -> Vec<usize> {
        vec![MAP_SIZE, MAP_SIZE, N_HAND]
    }

    fn weights(&self) -> Vec<f32> {
        vec![1.0; N_ROWS]
    }

    /// The crop is up to 1.2 times as large as necessary, and its centre is shifted by 10 px (standard deviation) of
    /// its 256 px.
    fn sample(&self, rng: &mut ChaCha8Rng, x: &mut [f32], y: &mut [f32]) {
        let (drawn, crop, (own, axes)) = loop {
            let drawn = sample_hand(rng);
            if let (Some(crop), Some(target)) = (Crop::around(&drawn.seen), canonical(&drawn.truth)) {
                break (drawn, crop, target);
            }
        };
        let side = crop.side * rng.random_range(1.0..1.2);
        let centre = crop.centre.map(|c| c + 10.0 / 256.0 * side * normal(rng));
        score_maps(&drawn.seen, Crop { centre, side }, x);
        let numbers = own.iter().chain(&axes).flatten();
        y.iter_mut().zip(numbers).for_each(|(y, v)| *y = *v as f32);
    }

    fn forward(&self, x: &Tensor, mode: &mut Mode) -> candle_core::Result<Tensor> {
        self.lifter.forward(x, &right_sides(x.dim(0)?, x)?, mode)
    }

    /// Mean squared error of the points plus that of the rotation matrix.
    fn loss(&self, out: &Tensor, target: &Tensor, _weights: &Tensor) -> candle_core::Result<Tensor> {
        let off = (out.reshape(target.shape())? - target)?.sqr()?;
        off.narrow(1, 0, N_HAND)?.mean_all()? + off.narrow(1, N_HAND, 3)?.mean_all()?
    }

    fn errors(&self, brief: bool) -> Result<Vec<String>> {
        errors(|seen| Ok(self.lifter.lift(seen, Side::Right)?), N_EVALUATED, brief)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_nn::lifter::score_maps::N_MAPS;
    use rand::SeedableRng;

    #[test]
    fn targets_are_hands_in_their_own_frame_and_a_right_answer_costs_nothing() -> Result<()> {
        let training_task = HeatmapLifterTask::new(1, &Device::Cpu)?;
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let (mut x, mut y) = (vec![0.0; N_MAPS], vec![0.0; 3 * N_ROWS]);
        training_task.sample(&mut rng, &mut x, &mut y);
        assert!(x.iter().all(|v| (0.0..=1.0).contains(v)) && x.iter().any(|v| *v > 0.9));
        assert!(y[3 * 9].abs() + y[3 * 9 + 2].abs() + y[3 * 17 + 2].abs() < 1e-6 && y[3 * 9 + 1] > 0.5);
        let y = Tensor::from_vec(y, (1, N_ROWS, 3), &Device::Cpu)?;
        let weights = Tensor::from_vec(training_task.weights(), (1, N_ROWS), &Device::Cpu)?;
        assert_eq!(training_task.loss(&y, &y, &weights)?.to_scalar::<f32>()?, 0.0);
        Ok(())
    }
}
