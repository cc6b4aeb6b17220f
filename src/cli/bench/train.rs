//! `orator bench train`: a training step of generator and discriminator in turns with PyTorch's, for the same networks,
//! batch, losses and optimiser; peak memory of both; how far apart they are; and where the time of a step goes.

use super::child::high_water_mib;
use super::reference::Reference;
use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, ensure};
use candle_core::{Device, Tensor, Var};
use orator::formats::checkpoint::Contents;
use orator::nn::cpu::thread_team::awake;
use orator::nn::gan::discriminator::{Discriminator, motion};
use orator::nn::gan::generator::{Config, Generator, Preset};
use orator::nn::ops::resize;
use orator::nn::params::Params;
use orator::stage::progress::Progress;
use orator::train::gan::losses::Adversarial;
use orator::train::optim::adam;
use orator::train::optim::adam::Adam;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

const N_NUMBERS: usize = 144;
const N_FRAMES: usize = 64;
/// Log-mels of a window: 68,267 samples.
const N_MELS: usize = 425;
const RATE: f64 = 1e-4;
const LOSS: Adversarial = Adversarial::LeastSquares;
/// Which outputs are compared.
const EVERY: usize = 97;

/// A training step of generator and discriminator on all cores: seconds, peak memory, where the time goes and, with
/// `--python`, the same of PyTorch. Both train the same networks on the same batch with L1 and the least-squares
/// adversarial loss, and move both with Adam.
#[derive(clap::Args)]
pub struct Args {
    /// The network: `light` or `paper`.
    #[arg(long, default_value = "light", value_name = "NAME")]
    preset: String,
    /// Windows of a step.
    #[arg(long, default_value_t = 32, value_name = "N")]
    batch: usize,
    /// Steps of a turn.
    #[arg(long, default_value_t = 3, value_name = "N")]
    steps: usize,
    /// Rounds; each measures every variant once.
    #[arg(long, default_value_t = 5, value_name = "N")]
    rounds: usize,
    /// The PyTorch reference, started as `REFERENCE.py serve FILE`; ORATOR_REFERENCE_PYTHON names its Python.
    #[arg(long, value_name = "FILE")]
    python: Option<PathBuf>,
}

struct Training {
    generator_params: Params,
    generator: Generator,
    discriminator_params: Params,
    discriminator: Discriminator,
    adam_g: Adam,
    adam_d: Adam,
    mels: Tensor,
    poses: Tensor,
}

impl Training {
    fn new(preset: Preset, batch: usize) -> Result<Self> {
        // Running statistics are no part of what is compared: one momentum for both networks.
        let config = Config { norm_momentum: 0.1, ..Config::of(preset, N_NUMBERS) };
        let (mut generator_params, mut discriminator_params) = (Params::new(1), Params::new(2));
        let generator = Generator::new(&mut generator_params, &config)?;
        let discriminator = Discriminator::new(&mut discriminator_params, N_NUMBERS)?;
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut draw = |shape: (usize, usize, usize)| {
            let n = shape.0 * shape.1 * shape.2;
            Tensor::from_vec((0..n).map(|_| rng.random_range(-1.0f32..1.0)).collect(), shape, &Device::Cpu)
        };
        Ok(Self {
            adam_g: Adam::new(&generator_params, adam::Config::default())?,
            adam_d: Adam::new(&discriminator_params, adam::Config::default())?,
            mels: draw((batch, 64, N_MELS))?,
            poses: draw((batch, N_NUMBERS, N_FRAMES))?,
            generator_params,
            generator,
            discriminator_params,
            discriminator,
        })
    }

    fn contents(&self) -> Result<Contents> {
        let mut contents = Contents { facts: json!({ "kind": "benchmark" }), tensors: BTreeMap::new() };
        contents.add("generator.", self.generator_params.tensors()?);
        contents.add("discriminator.", self.discriminator_params.tensors()?);
        contents.add("", [("mels", &self.mels), ("poses", &self.poses)].map(|(n, t)| (n.to_owned(), t.clone())).into());
        Ok(contents)
    }

    /// The step, as the trainer does it; L1, adversarial loss and that of the discriminator.
    fn step(&mut self) -> Result<[f32; 3]> {
        let made = self.generator.forward(&self.mels, N_FRAMES, true)?;
        let made_motion = motion(&made)?;
        let of_d = self.discriminator_step(&made_motion)?;
        let (l1, adversarial) = self.losses(&made, &made_motion)?;
        self.adam_g.step(&(&l1 + &adversarial)?.backward()?, RATE)?;
        Ok([l1.to_scalar()?, adversarial.to_scalar()?, of_d])
    }

    fn discriminator_step(&mut self, made_motion: &Tensor) -> Result<f32> {
        let real = self.discriminator.forward(&motion(&self.poses)?, true)?;
        let fake = self.discriminator.forward(&made_motion.detach(), true)?;
        let loss = LOSS.discriminator(&real, &fake)?;
        self.adam_d.step(&loss.backward()?, RATE)?;
        Ok(loss.to_scalar()?)
    }

    fn losses(&self, made: &Tensor, made_motion: &Tensor) -> Result<(Tensor, Tensor)> {
        let l1 = (made - &self.poses)?.abs()?.mean_all()?;
        Ok((l1, LOSS.generator(&self.discriminator.forward(made_motion, true)?)?))
    }

    /// Seconds of `steps` steps, and the last one's losses.
    fn train(&mut self, steps: usize) -> Result<(f64, [f32; 3])> {
        awake(|| {
            let (start, mut losses) = (Instant::now(), [0.0; 3]);
            for _ in 0..steps {
                losses = self.step()?;
            }
            Ok((start.elapsed().as_secs_f64(), losses))
        })
    }

    /// A step in parts that end where one can look at the clock: names and seconds.
    fn parts(&mut self) -> Result<Vec<(&'static str, f64)>> {
        let mut parts = Vec::new();
        let mut last = Instant::now();
        let mut part = |name| {
            parts.push((name, last.elapsed().as_secs_f64()));
            last = Instant::now();
        };
        let heard = self.generator.front(&self.mels, true)?;
        part("front forward");
        // The two halves of the way back are gone one after the other, the trunk's to a tensor that stands for `heard`.
        let stands_for = Var::from_tensor(&heard.detach())?;
        let made = self.generator.trunk(&resize::linear(&stands_for, N_FRAMES)?, true)?;
        part("trunk forward");
        let made_motion = motion(&made)?;
        self.discriminator_step(&made_motion)?;
        part("discriminator's step");
        let (l1, adversarial) = self.losses(&made, &made_motion)?;
        let loss = (l1 + adversarial)?;
        part("generator's losses");
        let mut gradients = loss.backward()?;
        part("trunk backward");
        let of_heard = gradients.get(&stands_for).context("the trunk gave no gradient")?.detach();
        let of_front = (heard * of_heard)?.sum_all()?.backward()?;
        part("front backward");
        for (_, var) in self.generator_params.trainables() {
            if let Some(gradient) = of_front.get(var) {
                gradients.insert(var, gradient.clone());
            }
        }
        part("");
        self.adam_g.step(&gradients, RATE)?;
        part("generator's Adam");
        parts.retain(|(name, _)| !name.is_empty());
        Ok(parts)
    }
}

pub fn run(args: &Args, ui: &Ui) -> Result<Outcome> {
    ensure!(
        args.rounds > 0 && args.steps > 0 && args.batch > 1,
        "nothing to measure: there must be rounds, steps and two windows a batch at least"
    );
    let folder = std::env::temp_dir().join(format!("orator-bench-{}", std::process::id()));
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let measured = measure(args, &folder, ui);
    let _ = std::fs::remove_dir_all(&folder);
    let (text, facts) = measured?;
    ui.summary(&text, None, facts);
    Ok(Outcome::Done)
}

fn measure(args: &Args, folder: &Path, ui: &Ui) -> Result<(String, Value)> {
    let n_threads = rayon::current_num_threads();
    let mut ours = Training::new(args.preset.parse()?, args.batch)?;
    let start = |script| Reference::start(script, n_threads, &ours.contents()?, &folder.join("given.safetensors"));
    let mut theirs = args.python.as_deref().map(start).transpose()?;
    let apart = theirs.as_mut().map(|theirs| apart(&mut ours, theirs)).transpose()?;

    let task = ui.begin("bench train", args.rounds as u64);
    let (mut own, mut their) = (vec![], vec![]);
    for _ in 0..args.rounds {
        own.push(ours.train(args.steps)?.0 / args.steps as f64);
        if let Some(theirs) = &mut theirs {
            their.push(theirs.secs(&format!("step {}", args.steps))? / args.steps as f64);
        }
        task.advance(1);
    }
    drop(task);
    let peak = high_water_mib(&std::fs::read_to_string("/proc/self/status").unwrap_or_default()).unwrap_or(f64::NAN);
    let parts = awake(|| ours.parts())?;

    let secs = super::median(own.clone());
    let mut text = format!(
        "{}: {} parameters, batch {}, {n_threads} threads, median of {} rounds of {} steps\n\
         this program     {:9.1} ms a step, peak memory {peak:6.0} MiB",
        args.preset,
        ours.generator_params.n_parameters() + ours.discriminator_params.n_parameters(),
        args.batch,
        args.rounds,
        args.steps,
        1e3 * secs
    );
    let mut facts = json!({ "preset": args.preset, "batch": args.batch, "threads": n_threads, "secs_a_step": secs,
        "peak_mib": peak });
    if let (Some(theirs), Some((outputs, losses))) = (&mut theirs, apart) {
        let memory = theirs.ask("memory")?["peak_mib"].as_f64().unwrap_or(f64::NAN);
        let ratio = super::median(own.iter().zip(&their).map(|(own, their)| own / their).collect());
        text += &format!(
            "\nPyTorch {:9}{:9.1} ms a step, peak memory {memory:6.0} MiB\n\
             this program takes {ratio:.2} of PyTorch's time and {:.2} of its memory\n\
             outputs at most {outputs:.1e} apart, over the largest; losses after one step {losses:.1e}",
            theirs.version(),
            1e3 * super::median(their.clone()),
            peak / memory
        );
        facts["pytorch"] = json!({ "version": theirs.version(), "secs_a_step": super::median(their),
            "peak_mib": memory, "ratio": ratio, "memory_ratio": peak / memory, "outputs_apart": outputs,
            "losses_apart": losses, "parts": theirs.ask("parts")? });
    }
    let whole: f64 = parts.iter().map(|(_, secs)| secs).sum();
    for (name, secs) in &parts {
        text += &format!("\n  {name:22}{:9.1} ms {:5.1} %", 1e3 * secs, 100.0 * secs / whole);
    }
    facts["parts"] = parts.into_iter().map(|(name, secs)| (name.to_owned(), json!(secs))).collect();
    Ok((text, facts))
}

/// Largest difference of the generator's outputs, over the largest output, and of the losses of the first step, over
/// the loss.
fn apart(ours: &mut Training, theirs: &mut Reference) -> Result<(f64, f64)> {
    let their: Vec<f64> = serde_json::from_value(theirs.ask("forward")?["made"].clone())?;
    let own = ours.generator.forward(&ours.mels, N_FRAMES, true)?.flatten_all()?.to_vec1::<f32>()?;
    ensure!(their.len() == own.len().div_ceil(EVERY), "the reference gave {} outputs, we {}", their.len(), own.len());
    let most = their.iter().fold(1e-9f64, |most, v| most.max(v.abs()));
    let outputs = own.iter().step_by(EVERY).zip(&their).map(|(own, their)| (f64::from(*own) - their).abs() / most);
    let their: Vec<f64> = serde_json::from_value(theirs.ask("step 1")?["losses"].clone())?;
    let (_, own) = ours.train(1)?;
    let losses = own.iter().zip(&their).map(|(own, their)| (f64::from(*own) - their).abs() / their.abs());
    Ok((outputs.fold(0.0, f64::max), losses.fold(0.0, f64::max)))
}
