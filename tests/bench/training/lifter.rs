//! `cargo bench -- lifter`: a training step of the temporal lifter on one thread, compared with PyTorch for the same
//! network, batch and optimiser; and the difference of the outputs.

use super::super::reference::Reference;
use super::super::report::{Report, median};
use anyhow::{Context, Result, ensure};
use candle_core::{Device, Tensor};
use orator_base::motion::view::body::{N_IN, N_OUT};
use orator_base::stage::progress::{Progress, Silent};
use orator_lab::train::supervised;
use orator_lab::train::supervised::{Schedule, TrainingTask};
use orator_nn::Mode;
use orator_nn::lifter::temporal::{Config, TemporalLifter};
use orator_nn::params::Params;
use orator_nn::weights::Contents;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Training of the temporal lifter on one thread: time per step, compared with PyTorch if `--python` is given. Both
/// train the same network on the same batch: forward, backward, gradient clipping, Adam with AMSGrad.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Number of channels of the network.
    #[arg(long, default_value_t = 256, value_name = "N")]
    channels: usize,
    /// Kernel widths, odd; their product is the window in frames.
    #[arg(long, default_values_t = [3, 3, 3], value_delimiter = ',', value_name = "N,N,...")]
    widths: Vec<usize>,
    /// Windows per step.
    #[arg(long, default_value_t = 512, value_name = "N")]
    batch: usize,
    /// Steps per round.
    #[arg(long, default_value_t = 5, value_name = "N")]
    steps: usize,
    /// Rounds; each measures every variant once.
    #[arg(long, default_value_t = 5, value_name = "N")]
    rounds: usize,
    /// Windows per epoch, for the time per epoch.
    #[arg(long, default_value_t = 100_000, value_name = "N")]
    epoch: usize,
    /// PyTorch reference script, run as `REFERENCE.py serve FILE` with the Python in ORATOR_REFERENCE_PYTHON.
    #[arg(long, value_name = "FILE")]
    python: Option<PathBuf>,
}

/// A training task with a constant batch, so that only the training step is measured.
struct FixedBatch {
    params: Params,
    net: TemporalLifter,
    /// Samples in order.
    x: Vec<f32>,
    y: Vec<f32>,
}

impl FixedBatch {
    fn new(config: &Config, batch: usize) -> Result<Self> {
        let mut params = Params::new(1);
        let net = TemporalLifter::new(&mut params, "body", config)?;
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut draw = |n: usize| (0..n).map(|_| rng.random_range(-1.0..1.0)).collect::<Vec<f32>>();
        let x = draw(batch * config.n_in * config.receptive_field());
        let y = draw(batch * config.n_out);
        Ok(Self { params, net, x, y })
    }

    fn batch(&self) -> usize {
        self.y.len() / self.net.config().n_out
    }

    /// The batch as tensors: `x` [B, n_in, window], `y` [B, points, 3].
    fn tensors(&self) -> Result<(Tensor, Tensor)> {
        let x = Tensor::from_slice(&self.x, [vec![self.batch()], self.shape_in()].concat(), &Device::Cpu)?;
        let y = Tensor::from_slice(&self.y, (self.batch(), N_OUT / 3, 3), &Device::Cpu)?;
        Ok((x, y))
    }

    /// Weights and batch as input of the reference.
    fn contents(&self) -> Result<Contents> {
        let mut contents = Contents { facts: json!({ "kind": "benchmark" }), tensors: BTreeMap::new() };
        contents.add("", self.params.tensors()?);
        let (x, y) = self.tensors()?;
        let weights = Tensor::from_vec(self.weights(), N_OUT / 3, &Device::Cpu)?;
        contents.add("", [("x", x), ("y", y), ("weights", weights)].map(|(name, t)| (name.to_owned(), t)).into());
        Ok(contents)
    }

    /// Largest difference from the outputs of both forms of the reference, relative to the largest output.
    fn output_difference(&self, reference: &mut Reference) -> Result<f64> {
        let answer = reference.ask("forward")?;
        let mut largest = 0.0f64;
        let (x, _) = self.tensors()?;
        let own: Vec<f32> = self.net.forward(&x, &mut Mode::Eval)?.flatten_all()?.to_vec1()?;
        for form in ["strided", "dilated"] {
            let their: Vec<f64> = serde_json::from_value(answer[form].clone())?;
            ensure!(
                their.len() == own.len(),
                "the reference returned {} {form} outputs, expected {}",
                their.len(),
                own.len()
            );
            let scale = their.iter().fold(1e-9f64, |largest, v| largest.max(v.abs()));
            let differences = own.iter().zip(&their).map(|(a, b)| (f64::from(*a) - b).abs() / scale);
            largest = differences.fold(largest, f64::max);
        }
        Ok(largest)
    }

    /// Seconds for `steps` training steps; the weights are saved to `scratch`.
    fn train(&mut self, steps: usize, scratch: &Path) -> Result<f64> {
        let batch = self.batch();
        let schedule =
            Schedule { steps, batch, learning_rate: 1e-3, seed: 0, checkpoint_every: usize::MAX, started_from: None };
        let start = Instant::now();
        supervised::train(self, &schedule, scratch, &Silent)?;
        Ok(start.elapsed().as_secs_f64())
    }
}

impl TrainingTask for FixedBatch {
    fn kind(&self) -> &'static str {
        "benchmark"
    }
    fn metadata(&self) -> Value {
        json!({ "config": self.net.config() })
    }
    fn params(&self) -> &Params {
        &self.params
    }
    fn shape_in(&self) -> Vec<usize> {
        vec![self.net.config().n_in, self.net.config().receptive_field()]
    }
    fn weights(&self) -> Vec<f32> {
        vec![1.0; N_OUT / 3]
    }
    fn sample(&self, rng: &mut ChaCha8Rng, x: &mut [f32], y: &mut [f32]) {
        // The trainer sets the random stream of a sample to its index.
        let sample = rng.get_stream() as usize % (self.batch() + 1);
        let part = |all: &[f32], to: &mut [f32]| {
            let start = sample * to.len();
            to.iter_mut().zip(all.iter().skip(start)).for_each(|(to, from)| *to = *from);
        };
        part(&self.x, x);
        part(&self.y, y);
    }
    fn forward(&self, x: &Tensor, mode: &mut Mode) -> candle_core::Result<Tensor> {
        self.net.forward(x, mode)
    }
    fn set_momentum(&mut self, momentum: f64) {
        self.net.set_momentum(momentum);
    }
    fn errors(&self, _brief: bool) -> Result<Vec<String>> {
        Ok(Vec::new())
    }
}

pub(crate) fn run(args: &Args, progress: &dyn Progress) -> Result<Report> {
    ensure!(
        args.rounds > 0 && args.steps > 0 && args.batch > 1 && args.channels > 0,
        "nothing to measure: there must be rounds, steps, channels, and two windows a batch at least"
    );
    ensure!(args.widths.iter().product::<usize>() <= 10_000, "a window of more than 10000 frames");
    let config =
        Config { n_in: N_IN, n_out: N_OUT, channels: args.channels, widths: args.widths.clone(), dropout: 0.0 };
    let folder = std::env::temp_dir().join(format!("orator-bench-{}", std::process::id()));
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot create the folder {}", folder.display()))?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let measured = pool.install(|| measure(args, &config, &folder, progress));
    let _ = std::fs::remove_dir_all(&folder);
    measured
}

fn measure(args: &Args, config: &Config, folder: &Path, progress: &dyn Progress) -> Result<Report> {
    let mut ours = FixedBatch::new(config, args.batch)?;
    let scratch = folder.join("trained.safetensors");
    // Two steps, so that the running statistics differ from their initial values.
    ours.train(2, &scratch)?;
    let mut theirs = match &args.python {
        Some(script) => Some(Reference::start(script, 1, &ours.contents()?, &folder.join("given.safetensors"))?),
        None => None,
    };
    let difference = theirs.as_mut().map(|theirs| ours.output_difference(theirs)).transpose()?;
    let task = progress.begin("lifter", args.rounds as u64);
    let (mut own, mut conv, mut linear) = (vec![], vec![], vec![]);
    for _ in 0..args.rounds {
        own.push(ours.train(args.steps, &scratch)? / args.steps as f64);
        if let Some(theirs) = &mut theirs {
            let mut step =
                |form| Ok::<_, anyhow::Error>(theirs.secs(&format!("step {} {form}", args.steps))? / args.steps as f64);
            conv.push(step("conv")?);
            linear.push(step("linear")?);
        }
        task.advance(1);
    }
    drop(task);
    let epoch = |secs: f64| secs * (args.epoch as f64 / args.batch as f64);
    let secs = median(own.clone());
    let mut text = format!(
        "{} parameters, window {} frames, batch {}, one thread, median of {} rounds of {} steps\n\
         this program          {:8.1} ms a step, {:6.1} s an epoch of {} windows",
        ours.params.n_parameters(),
        config.receptive_field(),
        args.batch,
        args.rounds,
        args.steps,
        1e3 * secs,
        epoch(secs),
        args.epoch
    );
    let mut facts = json!({ "parameters": ours.params.n_parameters(), "window": config.receptive_field(),
        "batch": args.batch, "secs_a_step": secs, "epoch_windows": args.epoch, "secs_an_epoch": epoch(secs) });
    if let (Some(theirs), Some(difference)) = (theirs, difference) {
        for (form, name, times) in [("conv", "strided conv1d", conv), ("linear", "reshape and linear", linear)] {
            let ratio = median(own.iter().zip(&times).map(|(own, their)| own / their).collect());
            let secs = median(times);
            text += &format!(
                "\nPyTorch, {name:19}{:6.1} ms a step, {:6.1} s an epoch: this program takes {ratio:.2} of it",
                1e3 * secs,
                epoch(secs)
            );
            facts[format!("pytorch_{form}_secs_a_step")] = json!(secs);
            facts[format!("ratio_to_pytorch_{form}")] = json!(ratio);
        }
        text +=
            &format!("\nPyTorch {}: outputs at most {difference:.1e} apart, over the largest output", theirs.version());
        facts["outputs_apart"] = json!(difference);
        facts["pytorch"] = json!(theirs.version());
    }
    Ok(Report { text, facts })
}
