//! Training of the lifters and of the body network: one loop over newly drawn samples. A `TrainingTask` defines the
//! network and its samples; this module has the schedule, the optimiser and resuming.

use anyhow::{Context, Result, ensure};
use candle_core::{DType, Tensor};
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir::FolderLock;
use orator_gesture::train::epochs::StoppedTraining;
use orator_gesture::train::log::MetricsLog;
use orator_gesture::train::log::ProgressLog;
use orator_gesture::train::optim::adam;
use orator_gesture::train::optim::adam::Adam;
use orator_nn::Mode;
use orator_nn::params::Params;
use orator_nn::weights::Contents;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Source of training samples, and the network they are fed to.
pub trait TrainingTask: Send + Sync {
    /// Kind of the weights file, stored in its metadata.
    fn kind(&self) -> &'static str;
    /// The network's configuration and everything else that the samples depend on; stored in the weights file.
    fn metadata(&self) -> Value;
    fn params(&self) -> &Params;
    /// Tensors of a weights file as this network's, if it has inputs that the file's network lacks.
    fn initial(&self, tensors: BTreeMap<String, Tensor>) -> Result<BTreeMap<String, Tensor>> {
        Ok(tensors)
    }
    /// Shape of one input sample.
    fn shape_in(&self) -> Vec<usize>;
    /// Loss weight of each output point; a target has three numbers per point.
    fn weights(&self) -> Vec<f32>;
    /// Number of samples drawn together from one scene.
    fn group(&self) -> usize {
        1
    }
    /// Draws a group of samples: inputs `x` and targets `y`. The last group of a batch may be smaller.
    fn sample(&self, rng: &mut ChaCha8Rng, x: &mut [f32], y: &mut [f32]);
    /// [B, input shape] to the prediction: [B, 3 x points] unless the task defines its own `loss`.
    fn forward(&self, x: &Tensor, mode: &mut Mode) -> candle_core::Result<Tensor>;
    /// Loss of the prediction `out` against the targets `target` [B, points, 3]; `weights` [1, points] have mean 1.
    /// Default: the weighted mean distance of the points.
    fn loss(&self, out: &Tensor, target: &Tensor, weights: &Tensor) -> candle_core::Result<Tensor> {
        let distance = ((out.reshape(target.shape())? - target)?.sqr()?.sum(2)? + 1e-8)?.sqrt()?;
        distance.broadcast_mul(weights)?.mean_all()
    }
    /// Sets the weight of a batch in the running statistics, if the network has any.
    fn set_momentum(&mut self, _momentum: f64) {}
    /// Errors on held-out samples, one line each; `brief`: of the network alone, on fewer samples.
    fn errors(&self, brief: bool) -> Result<Vec<String>>;
}

/// Training schedule.
#[derive(Clone, Debug)]
pub struct Schedule {
    pub steps: usize,
    pub batch: usize,
    /// Peak learning rate, reached after the warm-up.
    pub learning_rate: f64,
    pub seed: u64,
    /// Steps between checkpoints.
    pub checkpoint_every: usize,
    /// Hash of the weights it is initialised from (`start_from`); `None`: initialised from the seed.
    pub started_from: Option<String>,
}

/// Share of the steps of the linear warm-up.
const WARM_UP: f64 = 0.05;
/// Steps between lines of the log.
const LOG_EVERY: usize = 20;
/// Number of evaluations during training.
const N_EVALUATIONS: usize = 10;

impl Schedule {
    /// Learning rate of a step: linear warm-up, then half a cosine to zero.
    fn learning_rate(&self, step: usize) -> f64 {
        let share = (step as f64 + 0.5) / self.steps as f64;
        let shape = if share < WARM_UP {
            share / WARM_UP
        } else {
            0.5 + 0.5 * (std::f64::consts::PI * (share - WARM_UP) / (1.0 - WARM_UP)).cos()
        };
        self.learning_rate * shape
    }

    fn metadata(&self) -> Value {
        let mut facts =
            json!({ "steps": self.steps, "batch": self.batch, "learning_rate": self.learning_rate, "seed": self.seed });
        if let Some(hash) = &self.started_from {
            facts["started_from"] = json!(hash);
        }
        facts
    }
}

/// Initialises the task's network from a weights file; returns the hash of the file.
///
/// # Errors
/// The file cannot be read, is of another kind, or does not fit the network; the message names the file.
pub fn start_from(training_task: &dyn TrainingTask, path: &Path) -> Result<String> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read the weights {}", path.display()))?;
    let load = || -> Result<()> {
        let contents = Contents::from_bytes(&bytes)?;
        ensure!(
            contents.facts["kind"] == training_task.kind(),
            "its kind is {}, expected \"{}\"",
            contents.facts["kind"],
            training_task.kind()
        );
        training_task.params().load(&training_task.initial(contents.tensors)?)
    };
    load().with_context(|| format!("cannot initialise from {}", path.display()))?;
    Ok(blake3::hash(&bytes).to_hex().to_string())
}

/// Trains and writes the weights to `out`; returns the errors on held-out samples. With 0 steps it only evaluates. The
/// checkpoint `<out>.checkpoint` allows an interrupted training to resume with bit-identical results when called with
/// the same schedule and data; it is removed at the end. The log is `<out>.jsonl`.
///
/// # Errors
/// `BusyFolder` if another training uses `out`; `StoppedTraining`, after writing a checkpoint, if `progress` requests
/// a stop; a checkpoint of another schedule; a gradient that is not finite; a file that cannot be read or written.
pub fn train(
    training_task: &mut dyn TrainingTask,
    schedule: &Schedule,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Vec<String>> {
    if schedule.steps == 0 {
        return training_task.errors(false);
    }
    let _lock = FolderLock::exclusive(out)?;
    // Runs inside the pool, so that the thread need not sleep and wake up for every small task.
    rayon::scope(|_| train_until(training_task, schedule, out, schedule.steps, progress))?;
    let facts = facts(training_task, schedule);
    let weights = half_precision(training_task.params().tensors()?)?;
    // The errors are measured with the weights as stored (half precision).
    training_task.params().load(&weights)?;
    let errors = training_task.errors(false)?;
    let mut contents = Contents { facts, tensors: BTreeMap::new() };
    contents.add("", weights);
    contents.write(out)?;
    let checkpoint = sibling(out, ".checkpoint");
    if checkpoint.exists() {
        std::fs::remove_file(&checkpoint).with_context(|| format!("cannot remove {}", checkpoint.display()))?;
    }
    Ok(errors)
}

/// Metadata of the weights file and of the checkpoint.
fn facts(training_task: &dyn TrainingTask, schedule: &Schedule) -> Value {
    json!({ "kind": training_task.kind(), "lesson": training_task.metadata(), "schedule": schedule.metadata() })
}

/// Trains up to step `end`, which writes a checkpoint.
fn train_until(
    training_task: &mut dyn TrainingTask,
    schedule: &Schedule,
    out: &Path,
    end: usize,
    progress: &dyn Progress,
) -> Result<()> {
    ensure!(schedule.batch > 1, "invalid --batch {}: expected at least 2", schedule.batch);
    let mut adam =
        Adam::new(training_task.params(), adam::Config { amsgrad: true, max_norm: Some(1.0), ..Default::default() })?;
    let start = resume(training_task, schedule, out, &mut adam)?;
    if start > 0 {
        progress.say(&format!("resuming at step {start} of {}", schedule.steps));
    }
    let mut log = MetricsLog::lines_alone(&sibling(out, ".jsonl"), start)?;
    let weights = training_task.weights();
    let n_points = weights.len();
    let mean_weight = weights.iter().sum::<f32>() / n_points as f32;
    let weights: Vec<f32> = weights.iter().map(|w| w / mean_weight).collect();
    let weights = Tensor::from_vec(weights, (1, n_points), training_task.params().device())?;
    let task = progress.begin("training", (schedule.steps - start.min(schedule.steps)) as u64);
    let evaluate_every = schedule.steps.div_ceil(N_EVALUATIONS);
    let (mut sum, mut n_summed) = (0.0, 0);
    let mut progress_log = ProgressLog::new(start, schedule.steps);
    for step in start..end {
        let (x, y) = batch(training_task, schedule, step, n_points)?;
        // The weight of a batch in the running statistics decays from 0.1 to 0.001.
        training_task.set_momentum(0.1 * (-(step as f64 / schedule.steps as f64) * 100f64.ln()).exp());
        let mut rng = stream(schedule.seed, step, schedule.batch, schedule.batch);
        let prediction = training_task.forward(&x, &mut Mode::Train(&mut rng))?;
        let loss = training_task.loss(&prediction, &y, &weights)?;
        let norm = adam.step(&loss.backward()?, schedule.learning_rate(step))?;
        ensure!(norm.is_finite(), "the gradient of step {step} is not finite; use a smaller --learning-rate");
        let loss = f64::from(loss.to_scalar::<f32>()?);
        sum += loss;
        n_summed += 1;
        task.advance(1);
        if (step + 1) % LOG_EVERY == 0 || step + 1 == schedule.steps {
            task.detail(&format!("loss {:.4}", sum / f64::from(n_summed)));
            let rate = schedule.learning_rate(step);
            log.write(&json!({ "step": step + 1, "loss": loss, "gradient_norm": norm, "learning_rate": rate }))?;
        }
        if (step + 1) % evaluate_every == 0 {
            progress.say(&format!("step {} of {}: loss {:.4}", step + 1, schedule.steps, sum / f64::from(n_summed)));
            let errors = training_task.errors(true)?;
            errors.iter().for_each(|line| progress.say(&format!("  {line}")));
            log.write(&json!({ "step": step + 1, "errors": errors }))?;
            (sum, n_summed) = (0.0, 0);
        }
        if let Some(line) = progress_log.line(step + 1, &format!("loss {loss:.4}")) {
            task.milestone(&line);
        }
        let is_to_stop = progress.is_to_stop() && step + 1 < schedule.steps;
        if (step + 1) % schedule.checkpoint_every.max(1) == 0 || step + 1 == end || is_to_stop {
            let mut facts = facts(training_task, schedule);
            facts["step"] = json!(step + 1);
            let mut contents = Contents { facts, tensors: BTreeMap::new() };
            contents.add("net.", training_task.params().tensors()?);
            contents.add("", adam.tensors("adam.")?);
            contents.write(&sibling(out, ".checkpoint"))?;
        }
        if is_to_stop {
            let newest = Some(sibling(out, ".checkpoint"));
            return Err(StoppedTraining { step: step + 1, steps: schedule.steps, newest, best: None }.into());
        }
    }
    Ok(())
}

/// Loads the checkpoint of `out`, if any; returns the step to resume at.
fn resume(training_task: &dyn TrainingTask, schedule: &Schedule, out: &Path, adam: &mut Adam) -> Result<usize> {
    let path = sibling(out, ".checkpoint");
    if !path.exists() {
        return Ok(0);
    }
    let contents = Contents::read(&path)?;
    let fit = || -> Result<usize> {
        for (key, expected) in facts(training_task, schedule).as_object().into_iter().flatten() {
            let found = &contents.facts[key];
            let name = if key == "lesson" { "configuration" } else { key.as_str() };
            ensure!(
                found == expected,
                "its {name} is {found}, but this training has {expected}; choose another --out or remove the checkpoint"
            );
        }
        training_task.params().load(&contents.part("net."))?;
        Ok(contents.facts["step"].as_u64().context("it has no step number")? as usize)
    };
    let step = fit().with_context(|| format!("cannot resume from {}", path.display()))?;
    adam.load("adam.", &contents.tensors).with_context(|| format!("cannot resume from {}", path.display()))?;
    Ok(step)
}

/// Path of the weights file with `ending` appended.
fn sibling(out: &Path, ending: &str) -> PathBuf {
    let mut name = out.file_name().unwrap_or_default().to_owned();
    name.push(ending);
    out.with_file_name(name)
}

/// The samples of a step. Each group has its own random stream, so that the result depends neither on threads nor on
/// resuming.
fn batch(
    training_task: &dyn TrainingTask,
    schedule: &Schedule,
    step: usize,
    n_points: usize,
) -> Result<(Tensor, Tensor)> {
    let (n, shape) = (schedule.batch, training_task.shape_in());
    let (n_in, n_out) = (shape.iter().product::<usize>(), 3 * n_points);
    let (mut x, mut y) = (vec![0.0; n * n_in], vec![0.0; n * n_out]);
    let group = training_task.group();
    x.par_chunks_mut(group * n_in).zip(y.par_chunks_mut(group * n_out)).enumerate().for_each(|(i, (x, y))| {
        training_task.sample(&mut stream(schedule.seed, step, n, i), x, y);
    });
    let device = training_task.params().device();
    let x = Tensor::from_vec(x, [vec![n], shape].concat(), device)?;
    Ok((x, Tensor::from_vec(y, (n, n_points, 3), device)?))
}

/// Random stream of group `i` of a step of `batch` samples (`i == batch`: of the step itself).
fn stream(seed: u64, step: usize, batch: usize, i: usize) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream((step * (batch + 1) + i) as u64);
    rng
}

/// Converts matrices to half precision; vectors (biases, statistics) stay in single precision.
fn half_precision(tensors: BTreeMap<String, Tensor>) -> Result<BTreeMap<String, Tensor>> {
    let halve = |(name, t): (String, Tensor)| Ok((name, if t.rank() > 1 { t.to_dtype(DType::F16)? } else { t }));
    tensors.into_iter().map(halve).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::lifter::body::BodyLifterTask;
    use crate::train::lifter::hands::HandLifterTask;
    use candle_core::Device;
    use orator_base::stage::progress::Silent;
    use orator_nn::lifter::body::BodyLifter;

    const SCHEDULE: Schedule =
        Schedule { steps: 6, batch: 8, learning_rate: 1e-3, seed: 3, checkpoint_every: 2, started_from: None };

    fn resumed_equals_straight(training_task: impl Fn() -> Box<dyn TrainingTask>) {
        let dir = tempfile::tempdir().unwrap();
        let (straight, resumed) = (dir.path().join("a.safetensors"), dir.path().join("b.safetensors"));
        train(&mut *training_task(), &SCHEDULE, &straight, &Silent).unwrap();
        train_until(&mut *training_task(), &SCHEDULE, &resumed, 3, &Silent).unwrap();
        let other = Schedule { seed: 4, ..SCHEDULE };
        let text = format!("{:#}", train(&mut *training_task(), &other, &resumed, &Silent).unwrap_err());
        assert!(text.contains("schedule"), "{text}");
        train(&mut *training_task(), &SCHEDULE, &resumed, &Silent).unwrap();
        assert_eq!(std::fs::read(&straight).unwrap(), std::fs::read(resumed).unwrap());
        let measured =
            Schedule { steps: 0, started_from: Some(start_from(&*training_task(), &straight).unwrap()), ..SCHEDULE };
        assert!(!train(&mut *training_task(), &measured, &straight, &Silent).unwrap().is_empty());
        let log = |weights: &Path| std::fs::read_to_string(sibling(weights, ".jsonl")).unwrap();
        assert_eq!(log(&straight), log(&dir.path().join("b.safetensors")));
        assert!(log(&straight).lines().count() >= 6, "{}", log(&straight));
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 4, "weights and logs; checkpoints are removed");
    }

    #[test]
    fn an_interrupted_body_training_ends_in_the_same_bytes() {
        resumed_equals_straight(|| {
            Box::new(
                BodyLifterTask::new(Vec::new(), Vec::new(), &BodyLifter::config(8, &[3, 3, 3]), 3, &Device::Cpu)
                    .unwrap(),
            )
        });
    }

    #[test]
    fn an_interrupted_hand_training_ends_in_the_same_bytes() {
        resumed_equals_straight(|| Box::new(HandLifterTask::new(16, 3, &Device::Cpu).unwrap()));
    }

    #[test]
    fn the_learning_rate_warms_up_and_fades() {
        let schedule = Schedule { steps: 1000, ..SCHEDULE };
        let rates: Vec<f64> = (0..1000).map(|step| schedule.learning_rate(step)).collect();
        assert!(rates[0] < 2e-5 && rates[999] < 1e-5 && rates[49] > 0.98e-3 && rates[51] > 0.99e-3);
        assert!(rates.iter().all(|r| (0.0..=1e-3).contains(r)));
    }
}
