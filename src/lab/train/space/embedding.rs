//! Training task of the motion encoder (`nn::motion_encoder`): to reconstruct windows from a code of 32 numbers. Loss:
//! mean absolute error of the normalised bone directions plus that of their differences from frame to frame (as in the
//! auto-encoder of the GENEA evaluation); the six bones of arms and shoulders together have the weight of the forty
//! finger bones.

use super::auto_encoder::AutoEncoder;
use super::corpus::{Corpus, CorpusClip};
use crate::train::supervised::TrainingTask;
use anyhow::Result;
use candle_core::{Device, Tensor};
use ndarray::{Array2, ArrayView3, s};
use orator_base::math::vec3;
use orator_base::types::skeleton::{L_HAND, L_WRIST, N_JOINTS, R_HAND, R_WRIST, parent};
use orator_gesture::metrics::space::embedding::{KIND, WINDOW, directions};
use orator_gesture::metrics::space::fixed_rate::{N_COORDINATES, N_JOINTS_USED, joints_used};
use orator_nn::Mode;
use orator_nn::motion_encoder::Config;
use orator_nn::params::Params;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// Lower bound of the standard deviation in the normalisation, so that the noise of bones that hardly rotate is not
/// amplified.
const MIN_STD: f32 = 0.05;
/// Frames between held-out windows, and windows per evaluation batch.
const EVALUATION_STRIDE: usize = 17;
const EVALUATION_BATCH: usize = 128;

/// Training task of the network.
pub struct EmbeddingTask {
    params: Params,
    net: AutoEncoder,
    corpus: Corpus,
    /// Loss weight of each coordinate, [1, 138, 1].
    weights: Tensor,
    /// Bone directions [T, 138] of each clip.
    directions: Vec<Array2<f32>>,
    /// Cumulative number of windows, up to and including each clip.
    ends: Vec<usize>,
}

/// Sums of reconstruction errors over `n` frames.
#[derive(Clone, Copy, Debug, Default)]
struct EmbeddingErrors {
    n: usize,
    arms_mm: f64,
    fingers_mm: f64,
    degrees: f64,
}

impl EmbeddingTask {
    /// Creates a network initialised from `seed`, to be trained on `corpus`.
    pub fn new(corpus: Corpus, seed: u64) -> Result<Self> {
        let mut params = Params::new(seed);
        let net = AutoEncoder::new(&mut params, &Config::default())?;
        let directions: Vec<Array2<f32>> = corpus.clips.iter().map(|clip| directions(clip.joints.view())).collect();
        let ends = directions.iter().scan(0, |end, clip| {
            *end += (clip.nrows() + 1).saturating_sub(WINDOW);
            Some(*end)
        });
        let ends = ends.collect();
        let (mean, std) = statistics(&directions);
        net.encoder.set_statistics(&mean, &std)?;
        let weights = Tensor::from_vec(weights(), (1, N_COORDINATES, 1), &Device::Cpu)?;
        Ok(Self { params, net, corpus, weights, directions, ends })
    }

    /// Errors over the windows of `clips`: of the network, and of the corpus' mean pose.
    fn measure(&self, clips: &[CorpusClip]) -> Result<[EmbeddingErrors; 2]> {
        let mut errors = [EmbeddingErrors::default(); 2];
        for clip in clips {
            let starts: Vec<usize> =
                (0..(clip.joints.shape()[0] + 1).saturating_sub(WINDOW)).step_by(EVALUATION_STRIDE).collect();
            for starts in starts.chunks(EVALUATION_BATCH) {
                let windows: Vec<ArrayView3<f32>> =
                    starts.iter().map(|&start| clip.joints.slice(s![start..start + WINDOW, .., ..])).collect();
                let numbers: Vec<f32> = windows
                    .iter()
                    .flat_map(|window| directions(*window).reversed_axes().iter().copied().collect::<Vec<_>>())
                    .collect();
                let x = Tensor::from_vec(numbers, (windows.len(), N_COORDINATES, WINDOW), &Device::Cpu)?;
                let normal = self.net.encoder.normalised(&x)?;
                for (errors, back) in
                    errors.iter_mut().zip([self.net.forward(&normal, &Mode::Eval)?, normal.zeros_like()?])
                {
                    let back = self.net.encoder.plain(&back)?.transpose(1, 2)?.flatten_all()?.to_vec1::<f32>()?;
                    for (window, back) in windows.iter().zip(back.chunks_exact(WINDOW * N_COORDINATES)) {
                        errors.add(*window, back);
                    }
                }
            }
        }
        Ok(errors)
    }
}

impl EmbeddingErrors {
    /// Adds the errors of a window [34, 49, 3] whose directions were reconstructed as `back` [34 x 138]; joints are
    /// placed with the window's own bone lengths.
    fn add(&mut self, window: ArrayView3<f32>, back: &[f32]) {
        for (frame, back) in window.outer_iter().zip(back.chunks_exact(N_COORDINATES)) {
            let at = |joint: usize| -> vec3::Vec3 { std::array::from_fn(|k| f64::from(frame[[joint, k]])) };
            let mut placed = [[0.0; 3]; N_JOINTS];
            for (joint, back) in joints_used().zip(back.chunks_exact(3)) {
                let from = parent(joint).unwrap_or_default();
                let base = match from {
                    _ if joint < L_HAND => from,
                    L_HAND => L_WRIST,
                    R_HAND => R_WRIST,
                    _ => from,
                };
                let bone = vec3::sub(at(joint), at(from));
                let along = vec3::unit([0, 1, 2].map(|k| f64::from(back[k])), 1e-6).unwrap_or_default();
                placed[joint] = vec3::add(placed[base], vec3::scale(along, vec3::norm(bone)));
                let cos = vec3::unit(bone, 1e-6).map_or(1.0, |bone| vec3::dot(bone, along)).clamp(-1.0, 1.0);
                self.degrees += cos.acos().to_degrees() / N_JOINTS_USED as f64;
                if joint < L_HAND {
                    self.arms_mm += 1000.0 / 6.0 * vec3::norm(vec3::sub(placed[joint], at(joint)));
                } else {
                    // Finger joints are compared relative to their own wrist.
                    let wrist = if joint < R_HAND { L_WRIST } else { R_WRIST };
                    let own = vec3::sub(placed[joint], placed[wrist]);
                    self.fingers_mm += 1000.0 / 40.0 * vec3::norm(vec3::sub(own, vec3::sub(at(joint), at(wrist))));
                }
            }
            self.n += 1;
        }
    }

    fn line(&self) -> String {
        let mean = |sum: f64| sum / self.n.max(1) as f64;
        format!(
            "arms {:5.1} mm, fingers relative to their wrist {:5.1} mm, bones {:4.1} degrees",
            mean(self.arms_mm),
            mean(self.fingers_mm),
            mean(self.degrees)
        )
    }
}

/// Loss weight of each of the 138 coordinates, 1 on average: arms and shoulders together weigh as much as all fingers.
fn weights() -> Vec<f32> {
    let n_arms = joints_used().filter(|joint| *joint < L_HAND).count();
    let of = |joint: usize| {
        let n = if joint < L_HAND { n_arms } else { N_JOINTS_USED - n_arms };
        N_JOINTS_USED as f32 / (2 * n) as f32
    };
    joints_used().flat_map(|joint| [of(joint); 3]).collect()
}

/// Mean and standard deviation of each of the 138 coordinates.
fn statistics(clips: &[Array2<f32>]) -> (Vec<f32>, Vec<f32>) {
    let mut sums = [(0.0f64, 0.0f64); N_COORDINATES];
    let mut n = 0.0;
    for row in clips.iter().flat_map(|clip| clip.outer_iter()) {
        n += 1.0;
        for ((sum, squares), v) in sums.iter_mut().zip(row) {
            *sum += f64::from(*v);
            *squares += f64::from(*v).powi(2);
        }
    }
    let n = f64::max(n, 1.0);
    let std = |(sum, squares): &(f64, f64)| ((squares / n - (sum / n).powi(2)).max(0.0).sqrt() as f32).max(MIN_STD);
    (sums.iter().map(|(sum, _)| (sum / n) as f32).collect(), sums.iter().map(std).collect())
}

impl TrainingTask for EmbeddingTask {
    fn kind(&self) -> &'static str {
        KIND
    }

    fn metadata(&self) -> Value {
        json!({ "config": Config::default(), "corpus": self.corpus.metadata() })
    }

    fn params(&self) -> &Params {
        &self.params
    }

    fn shape_in(&self) -> Vec<usize> {
        vec![N_COORDINATES, WINDOW]
    }

    fn weights(&self) -> Vec<f32> {
        vec![1.0; N_JOINTS_USED * WINDOW]
    }

    fn sample(&self, rng: &mut ChaCha8Rng, x: &mut [f32], _: &mut [f32]) {
        let Some(&n) = self.ends.last().filter(|n| **n > 0) else { return };
        let at = rng.random_range(0..n);
        let clip = self.ends.partition_point(|&end| end <= at);
        let start = at - if clip == 0 { 0 } else { self.ends[clip - 1] };
        let window = self.directions[clip].slice(s![start..start + WINDOW, ..]).reversed_axes();
        x.iter_mut().zip(window).for_each(|(to, from)| *to = *from);
    }

    /// Residual in normalised units: reconstruction minus window. The loss compares it with zero, not with `y`.
    fn forward(&self, x: &Tensor, mode: &mut Mode) -> candle_core::Result<Tensor> {
        let x = self.net.encoder.normalised(x)?;
        self.net.forward(&x, mode)? - x
    }

    fn loss(&self, out: &Tensor, _: &Tensor, _: &Tensor) -> candle_core::Result<Tensor> {
        let rest = out.reshape((out.dim(0)?, N_COORDINATES, WINDOW))?.broadcast_mul(&self.weights)?;
        let steps = (rest.narrow(2, 1, WINDOW - 1)? - rest.narrow(2, 0, WINDOW - 1)?)?;
        rest.abs()?.mean_all()? + steps.abs()?.mean_all()?
    }

    fn set_momentum(&mut self, momentum: f64) {
        self.net.set_momentum(momentum);
    }

    fn errors(&self, brief: bool) -> Result<Vec<String>> {
        let mut lines = Vec::new();
        for (set, clips) in &self.corpus.held_out {
            let [network, mean] = self.measure(clips)?;
            lines.push(format!("{set:32} {}", network.line()));
            if !brief {
                lines.push(format!("{:32} {}", "  baseline: mean pose", mean.line()));
            }
        }
        Ok(lines)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::supervised::{Schedule, start_from, train};
    use orator_base::stage::progress::Silent;
    use std::path::Path;

    /// Millimetres of arms and fingers in a line of errors.
    fn mm(line: &str) -> [f64; 2] {
        let number = |before: &str| line.split(before).nth(1).unwrap().split_whitespace().next().unwrap().parse();
        [number("arms").unwrap(), number("wrist").unwrap()]
    }

    #[test]
    fn what_a_training_writes_is_an_encoder_and_the_built_in_one_gives_motion_back() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("e.safetensors");
        let mut training_task = EmbeddingTask::new(Corpus::new(&[], &[], &[], &[], 3).unwrap(), 3).unwrap();
        let built_in = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/motion_embedding.safetensors");
        start_from(&training_task, &built_in).unwrap();
        let lines = training_task.errors(false).unwrap();
        for (network, mean) in mm(&lines[0]).into_iter().zip(mm(&lines[1])) {
            assert!(network < 0.5 * mean, "{lines:?}");
        }
        let schedule =
            Schedule { steps: 3, batch: 8, learning_rate: 1e-3, seed: 3, checkpoint_every: 100, started_from: None };
        let lines = train(&mut training_task, &schedule, &out, &Silent).unwrap();
        assert!(lines.len() == 2 && lines[1].contains("mean pose"), "{lines:?}");
        let encoder = orator_gesture::metrics::space::embedding::parse(&std::fs::read(&out).unwrap()).unwrap();
        let codes = encoder.codes(training_task.directions[0].view(), 4).unwrap();
        assert!(codes.iter().all(|v| v.is_finite()) && codes.nrows() == (300 - 34) / 4 + 1);
    }
}
