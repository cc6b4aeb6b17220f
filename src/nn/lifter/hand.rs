//! The hand lifter: 21 joints from the 21 keypoints of one hand in one frame. A perceptron on coordinates, which
//! contain the same information as heat maps drawn at these points (used by Zimmermann & Brox 2017).

use crate::Mode;
use crate::ops::dropout::dropout;
use crate::params::{Init, Params};
use candle_core::{Module, Result, Tensor};
use candle_nn::Linear;
use orator_base::motion::view::hand::{HandJoints, HandPoints, HandView};
use orator_base::types::skeleton::Side;
use serde::{Deserialize, Serialize};

/// Prefix of the network's tensors in a weights file.
pub const NAME: &str = "hand";
pub const KIND: &str = "hand-lifter";

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Number of inputs of a hand: 21 x (x, y, visible).
    pub n_in: usize,
    /// Number of outputs: 21 x (x, y, z).
    pub n_out: usize,
    /// Width of the two hidden layers.
    pub hidden: usize,
    pub dropout: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self { n_in: 63, n_out: 63, hidden: 512, dropout: 0.0 }
    }
}

/// Three fully connected layers with leaky ReLU (slope 0.01) in between.
pub struct HandLifter {
    config: Config,
    layers: [Linear; 3],
}

impl HandLifter {
    /// Creates the network's tensors under `<name>.`.
    pub fn new(params: &mut Params, name: &str, config: &Config) -> Result<Self> {
        let Config { n_in, n_out, hidden, .. } = *config;
        let mut layer = |i: usize, n: [usize; 2]| params.linear(&format!("{name}.{i}"), n, Init::He, 0.0);
        let layers = [layer(0, [n_in, hidden])?, layer(1, [hidden, hidden])?, layer(2, [hidden, n_out])?];
        Ok(Self { config: config.clone(), layers })
    }

    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Maps [B, n_in] to [B, n_out].
    pub fn forward(&self, x: &Tensor, mode: &mut Mode) -> Result<Tensor> {
        let [first, second, last] = &self.layers;
        let x = dropout(&candle_nn::ops::leaky_relu(&first.forward(x)?, 0.01)?, self.config.dropout, mode)?;
        let x = dropout(&candle_nn::ops::leaky_relu(&second.forward(&x)?, 0.01)?, self.config.dropout, mode)?;
        last.forward(&x)
    }

    /// Lifts hands of the given side to px in picture axes, wrist at 0; `None` where too few points are visible.
    pub fn lift(&self, seen: &[HandPoints], side: Side) -> Result<Vec<Option<HandJoints>>> {
        let views: Vec<Option<HandView>> = seen.iter().map(|s| HandView::new(s, side)).collect();
        let x: Vec<f32> = views.iter().flatten().flat_map(|view| view.numbers).collect();
        if x.is_empty() {
            return Ok(vec![None; seen.len()]);
        }
        let n_views = views.iter().flatten().count();
        let x = Tensor::from_vec(x, (n_views, self.config.n_in), self.layers[0].weight().device())?;
        let y = self.forward(&x, &mut Mode::Eval)?.flatten_all()?.to_vec1::<f32>()?;
        let mut outputs = y.chunks_exact(self.config.n_out);
        Ok(views.iter().map(|view| view.as_ref().and_then(|view| Some(view.hand(outputs.next()?)))).collect())
    }
}
