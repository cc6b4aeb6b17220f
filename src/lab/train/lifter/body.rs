//! Training task of the body lifter: windows of captured, rendered and procedural motion, filmed by random cameras.

use super::errors::of_method;
use crate::mocap::upper_body::{BodyTake, Set};
use crate::train::scene::body::{FilmedScene, Filming, scenes};
use crate::train::supervised::TrainingTask;
use anyhow::Result;
use candle_core::{Device, Tensor};
use orator_base::motion::upper_body::N_POINTS;
use orator_base::motion::view::body::{BodyView, N_BODY_IN, N_IN, N_OUT};
use orator_nn::Mode;
use orator_nn::lifter::body::BodyLifter;
use orator_nn::lifter::temporal::Config;
use orator_nn::params::Params;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Weight of the first convolution, [channels, inputs, width].
const FIRST_WEIGHT: &str = "body.expand.conv.weight";
/// Loss weight of each point: nose, arms, hips.
const WEIGHTS: [f32; N_POINTS] = [1.0, 1.0, 1.2, 1.5, 1.0, 1.2, 1.5, 0.7, 0.7];
/// Shares of scenes with captured motion and with rendered persons, if available, and with motion over the reachable
/// space of the arms; the rest are procedural gestures.
const CAPTURED: f64 = 0.35;
const RENDERED: f64 = 0.2;
const REACH: f64 = 0.25;
/// Share of the captured scenes in which one arm comes from another take.
const MIXED: f64 = 0.35;
/// Smallest and largest number of frames of a scene, and the number of windows cut from it.
const SCENE_FRAMES: std::ops::RangeInclusive<usize> = 30..=84;
const WINDOWS: usize = 4;
/// Number of evaluation scenes per set, and the number for a brief evaluation.
const N_SCENES: usize = 120;
const N_SCENES_BRIEF: usize = 40;

/// Training task of the network.
pub struct BodyLifterTask {
    params: Params,
    lifter: BodyLifter,
    captured: TakePool,
    rendered: TakePool,
    /// Takes used for evaluation only.
    held_out: Vec<Set>,
}

impl BodyLifterTask {
    /// Creates a network on `device`, initialised from `seed`, to be trained on `takes`; `held_out` takes are used for
    /// evaluation only.
    ///
    /// # Errors
    /// A configuration from which no network can be created.
    pub fn new(
        mut takes: Vec<BodyTake>,
        held_out: Vec<Set>,
        config: &Config,
        seed: u64,
        device: &Device,
    ) -> Result<Self> {
        takes.sort_by(|a, b| a.name.cmp(&b.name));
        let mut params = Params::new(seed).on(device);
        let lifter = BodyLifter::new(&mut params, config)?;
        let (rendered, captured) = takes.into_iter().partition(|take| take.rendered);
        Ok(Self { params, lifter, captured: TakePool::new(captured), rendered: TakePool::new(rendered), held_out })
    }

    fn scene(&self, rng: &mut ChaCha8Rng) -> FilmedScene {
        let n_frames = rng.random_range(SCENE_FRAMES);
        let kind = rng.random_range(0.0..1.0);
        let pool = if kind < CAPTURED { &self.captured } else { &self.rendered };
        if let (true, Some(take)) = (kind < CAPTURED + RENDERED, pool.sample(rng)) {
            let other = if !take.rendered && rng.random_bool(MIXED) { pool.sample(rng) } else { None };
            // A take that is too short for `n_frames` may suffice for the shortest scene.
            for n_frames in [n_frames, *SCENE_FRAMES.start()] {
                if let Some(scene) = FilmedScene::from_take(take, other, Filming::Training, n_frames, rng) {
                    return scene;
                }
            }
        }
        if kind < CAPTURED + RENDERED + REACH {
            FilmedScene::from_reach(Filming::Training, n_frames, rng)
        } else {
            FilmedScene::from_rule(Filming::Training, n_frames, rng)
        }
    }
}

/// Takes to sample from.
struct TakePool {
    takes: Vec<BodyTake>,
    /// Cumulative duration of `takes` in seconds: takes are sampled in proportion to their duration.
    ends: Vec<f64>,
}

impl TakePool {
    fn new(takes: Vec<BodyTake>) -> Self {
        let ends = takes.iter().scan(0.0, |end, take| {
            *end += take.poses.len() as f64 / take.fps;
            Some(*end)
        });
        Self { ends: ends.collect(), takes }
    }

    fn sample(&self, rng: &mut ChaCha8Rng) -> Option<&BodyTake> {
        let at = rng.random_range(0.0..*self.ends.last()?);
        self.takes.get(self.ends.partition_point(|&end| end <= at))
    }
}

impl TrainingTask for BodyLifterTask {
    fn kind(&self) -> &'static str {
        "body-lifter"
    }

    fn metadata(&self) -> Value {
        let mut hash = blake3::Hasher::new();
        for take in self.captured.takes.iter().chain(&self.rendered.takes) {
            hash.update(take.name.as_bytes());
            for value in take.poses.iter().flatten().flatten() {
                hash.update(&value.to_le_bytes());
            }
        }
        let frames = |pool: &TakePool| pool.takes.iter().map(|take| take.poses.len()).sum::<usize>();
        json!({
            "config": self.lifter.net.config(),
            "takes": self.captured.takes.len(), "rendered": self.rendered.takes.len(),
            "frames": frames(&self.captured) + frames(&self.rendered),
            "held_out": self.held_out.iter().map(|(set, _)| set).collect::<Vec<_>>(),
            "motion": hash.finalize().to_hex().as_str(),
        })
    }

    fn params(&self) -> &Params {
        &self.params
    }

    /// Weights of a network without hands begin with zeros for these.
    fn initial(&self, mut tensors: BTreeMap<String, Tensor>) -> Result<BTreeMap<String, Tensor>> {
        if let Some(weight) = tensors.get_mut(FIRST_WEIGHT)
            && weight.dim(1)? == N_BODY_IN
        {
            *weight = weight.pad_with_zeros(1, 0, N_IN - N_BODY_IN)?;
        }
        Ok(tensors)
    }

    fn shape_in(&self) -> Vec<usize> {
        vec![N_IN, self.lifter.net.config().receptive_field()]
    }

    fn weights(&self) -> Vec<f32> {
        WEIGHTS.to_vec()
    }

    fn group(&self) -> usize {
        WINDOWS
    }

    fn sample(&self, rng: &mut ChaCha8Rng, x: &mut [f32], y: &mut [f32]) {
        let window = self.lifter.net.config().receptive_field();
        let mut scene = self.scene(rng);
        for (x, y) in x.chunks_exact_mut(N_IN * window).zip(y.chunks_exact_mut(N_OUT)) {
            // Where the shoulders are not visible, which is rare, another scene is drawn.
            let (t, view) = loop {
                let t = rng.random_range(0..scene.seen.len());
                match BodyView::around(&scene.seen, &scene.hands, t, window, 1.0) {
                    Some(_) if scene.disturbed[t] => {}
                    Some(view) => break (t, view),
                    None => scene = self.scene(rng),
                }
            };
            x.copy_from_slice(&view.numbers);
            let grow = scene.px_per_metre / f64::from(view.scale);
            for (j, p) in scene.truth[t].iter().enumerate() {
                let [seen_x, seen_y] = view.middle(j);
                y[3 * j] = (p[0] * grow) as f32 - seen_x;
                y[3 * j + 1] = (p[1] * grow) as f32 - seen_y;
                y[3 * j + 2] = (p[2] * grow) as f32;
            }
        }
    }

    fn forward(&self, x: &Tensor, mode: &mut Mode) -> candle_core::Result<Tensor> {
        debug_assert_eq!(N_OUT, 3 * N_POINTS);
        self.lifter.net.forward(x, mode)
    }

    fn set_momentum(&mut self, momentum: f64) {
        self.lifter.net.set_momentum(momentum);
    }

    fn errors(&self, brief: bool) -> Result<Vec<String>> {
        let n = if brief { N_SCENES_BRIEF } else { N_SCENES };
        let mut lines = Vec::new();
        let procedural = ("procedural gestures".to_owned(), Vec::new());
        for (set, takes) in self.held_out.iter().chain([&procedural]) {
            for (filming, input) in [(Filming::Drop, "drop "), (Filming::Clean, "clean")] {
                let scenes = scenes(takes, filming, n);
                if scenes.is_empty() {
                    continue;
                }
                lines.push(format!(
                    "{set:30} {input}  {}",
                    of_method(&scenes, |scene| Ok(self.lifter.poses(&scene.seen, &[], 1.0)?))?
                ));
                if brief {
                    break;
                }
            }
        }
        Ok(lines)
    }
}
