//! What the body lifter learns: windows of captured motion and of motion made by rule, filmed by random cameras.

use super::body_errors::{mean_pose, of_method, with_bone_depth, with_mean_depth};
use super::body_scene::{Body, Scene};
use super::lifter::Lesson;
use crate::motion::mocap::Take;
use crate::motion::upper_body::{N_IN, N_OUT, N_POINTS, View, WINDOW};
use crate::nn::Mode;
use crate::nn::body_lifter::BodyLifter;
use crate::nn::params::Params;
use anyhow::{Context, Result};
use candle_core::Tensor;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// Weight of each point in the loss: nose, arms, hips.
const WEIGHTS: [f32; N_POINTS] = [1.0, 1.0, 1.2, 1.5, 1.0, 1.2, 1.5, 0.4, 0.4];
/// Share of samples from captured motion, where there is any.
const CAPTURED: f64 = 0.45;
/// Every n-th take, by name, is held out.
const HELD_OUT: usize = 5;
/// Frames of a scene that errors are measured on, and how many scenes of a kind.
const SCENE_FRAMES: usize = 60;
const SCENES: usize = 120;

/// The lesson.
pub struct BodyLesson {
    params: Params,
    lifter: BodyLifter,
    channels: usize,
    takes: Vec<Take>,
    /// Sum of the frames of `takes` up to and with each: longer takes are drawn more often.
    ends: Vec<usize>,
    held_out: Vec<Take>,
    /// Captured motion of other sources, only to measure errors on.
    strangers: Vec<Take>,
}

impl BodyLesson {
    /// A network of `channels` with first values from `seed`; every fifth take is held out.
    pub fn new(mut takes: Vec<Take>, channels: usize, seed: u64) -> Result<Self> {
        takes.sort_by(|a, b| a.name.cmp(&b.name));
        let (mut trained, mut held_out) = (Vec::new(), Vec::new());
        for (i, take) in takes.into_iter().enumerate() {
            if i % HELD_OUT == HELD_OUT - 1 { held_out.push(take) } else { trained.push(take) }
        }
        let mut params = Params::new(seed);
        let lifter = BodyLifter::new(&mut params, &BodyLifter::config(channels))?;
        let ends = trained.iter().scan(0, |end, take| {
            *end += (take.poses.len() as f64 * 60.0 / take.fps) as usize;
            Some(*end)
        });
        let ends = ends.collect();
        Ok(Self { params, lifter, channels, ends, takes: trained, held_out, strangers: Vec::new() })
    }

    /// Takes to measure errors on beside the held-out ones.
    pub fn with_strangers(self, strangers: Vec<Take>) -> Self {
        Self { strangers, ..self }
    }

    fn scene(&self, rng: &mut ChaCha8Rng) -> Scene {
        let all = self.ends.last().copied().unwrap_or(0);
        if all > 0 && rng.random_bool(CAPTURED) {
            let at = rng.random_range(0..all);
            let take = &self.takes[self.ends.partition_point(|&end| end <= at)];
            if let Some(scene) = Scene::of_take(take, Body::Any, WINDOW, false, rng) {
                return scene;
            }
        }
        Scene::of_rule(WINDOW, false, rng)
    }

    /// Scenes of takes in turn, or of motion made by rule when there are none; the same ones whenever asked.
    fn scenes(takes: &[Take], n: usize, clean: bool) -> Vec<Scene> {
        let mut rng = ChaCha8Rng::seed_from_u64(20_000);
        let long: Vec<&Take> =
            takes.iter().filter(|t| t.poses.len() as f64 / t.fps > SCENE_FRAMES as f64 / 15.0 + 0.1).collect();
        let scene = |i: usize, rng: &mut ChaCha8Rng| {
            let captured =
                long.get(i % long.len().max(1)).and_then(|t| Scene::of_take(t, Body::Mean, SCENE_FRAMES, clean, rng));
            captured.unwrap_or_else(|| Scene::of_rule(SCENE_FRAMES, clean, rng))
        };
        (0..n).map(|i| scene(i, &mut rng)).collect()
    }

    fn lift(&self, scene: &Scene) -> Result<Vec<crate::motion::upper_body::Pose>> {
        let poses: Option<Vec<_>> = self.lifter.poses(&scene.seen, 1.0)?.into_iter().collect();
        poses.context("a scene without shoulders")
    }
}

impl Lesson for BodyLesson {
    fn kind(&self) -> &'static str {
        "body-lifter"
    }

    fn facts(&self) -> Value {
        let frames = |takes: &[Take]| takes.iter().map(|t| t.poses.len()).sum::<usize>();
        json!({
            "config": BodyLifter::config(self.channels),
            "takes": self.takes.len(), "frames": frames(&self.takes),
            "held_out_takes": self.held_out.len(), "held_out_frames": frames(&self.held_out),
        })
    }

    fn params(&self) -> &Params {
        &self.params
    }

    fn shape_in(&self) -> Vec<usize> {
        vec![N_IN, WINDOW]
    }

    fn weights(&self) -> Vec<f32> {
        WEIGHTS.to_vec()
    }

    fn draw(&self, rng: &mut ChaCha8Rng, x: &mut [f32], y: &mut [f32]) {
        // a scene whose shoulders are never seen is drawn again; it is rare
        let (scene, view) = loop {
            let scene = self.scene(rng);
            if let Some(view) = View::of(&scene.seen) {
                break (scene, view);
            }
        };
        x.copy_from_slice(&view.numbers);
        let grow = scene.px_per_metre / f64::from(view.scale);
        for (j, p) in scene.truth[WINDOW / 2].iter().enumerate() {
            let [seen_x, seen_y] = view.middle(j);
            y[3 * j] = (p[0] * grow) as f32 - seen_x;
            y[3 * j + 1] = (p[1] * grow) as f32 - seen_y;
            y[3 * j + 2] = (p[2] * grow) as f32;
        }
    }

    fn forward(&self, x: &Tensor, mode: &mut Mode) -> candle_core::Result<Tensor> {
        debug_assert_eq!(N_OUT, 3 * N_POINTS);
        self.lifter.net().forward_windows(x, mode)
    }

    fn set_momentum(&mut self, momentum: f64) {
        self.lifter.net_mut().set_momentum(momentum);
    }

    fn errors(&self, brief: bool) -> Result<Vec<String>> {
        let n = if brief { SCENES / 6 } else { SCENES };
        let sets =
            [("held-out captured", &self.held_out), ("other captured", &self.strangers), ("made by rule", &Vec::new())];
        let mut lines = Vec::new();
        let known = Self::scenes(&self.takes, n, true);
        let mean = mean_pose(&known);
        for (i, (set, takes)) in sets.into_iter().enumerate() {
            if takes.is_empty() && i < 2 {
                continue;
            }
            let spoiled = Self::scenes(takes, n, false);
            lines.push(format!("{set:18} lifter               {}", of_method(&spoiled, |s| self.lift(s))?));
            if brief {
                continue;
            }
            let clean = Self::scenes(takes, n, true);
            lines.push(format!("{set:18} lifter, clean input  {}", of_method(&clean, |s| self.lift(s))?));
            lines.push(format!("{set:18} bone-length depth    {}", of_method(&clean, |s| Ok(with_bone_depth(s)))?));
            lines.push(format!(
                "{set:18} mean depth a joint   {}",
                of_method(&clean, |s| Ok(with_mean_depth(s, &mean)))?
            ));
            lines.push(format!(
                "{set:18} constant mean pose   {}",
                of_method(&clean, |s| Ok(vec![mean; s.truth.len()]))?
            ));
        }
        Ok(lines)
    }
}
