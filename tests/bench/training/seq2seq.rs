//! `cargo bench -- seq2seq`: a training step of the FineMotion networks, compared with PyTorch for the same weights,
//! batch, losses and optimiser: time, peak memory and difference of the poses; and the speed of generation.

use super::super::child::own_peak_mib;
use super::super::reference::Reference;
use super::super::report::{Report, median};
use anyhow::{Context, Result, ensure};
use candle_core::{DType, Device, Tensor};
use orator_base::stage::progress::Progress;
use orator_dataset::config::Seq2seqSettings;
use orator_gesture::train::optim::adam::{self, Adam};
use orator_gesture::train::seq2seq::losses;
use orator_nn::Mode;
use orator_nn::params::Params;
use orator_nn::seq2seq::config::{Config, Segment};
use orator_nn::seq2seq::networks::{ContextSeq2Seq, WordsSeq2Seq};
use orator_nn::seq2seq::predict::{GesturePredictor, StateAtSeams, generate};
use orator_nn::weights::Contents;
use orator_test_support::gradcheck::pattern;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

const VOCABULARY: usize = 5000;
/// Number of words per segment, and around a pose.
const WORDS: [usize; 2] = [15, 10];
const LEARNING_RATE: f64 = 1e-3;
/// Frames per second.
const FPS: f64 = 20.0;
/// Number of segments to generate.
const SEGMENTS: usize = 20;

/// A training step of a sequence-to-sequence network, and generation with it.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The contextual network instead of the words network.
    #[arg(long)]
    contextual: bool,
    /// Segments per step.
    #[arg(long, default_value_t = 50, value_name = "N")]
    batch: usize,
    /// Steps per round.
    #[arg(long, default_value_t = 3, value_name = "N")]
    steps: usize,
    /// Rounds; each measures every variant once.
    #[arg(long, default_value_t = 5, value_name = "N")]
    rounds: usize,
    /// PyTorch reference script, run as `REFERENCE.py serve FILE` with the Python in ORATOR_REFERENCE_PYTHON.
    #[arg(long, value_name = "FILE")]
    python: Option<PathBuf>,
}

/// A network with its optimiser and a constant batch.
struct FixedBatch {
    network: Box<dyn GesturePredictor>,
    params: Params,
    adam: Adam,
    segment: Segment,
    target: Tensor,
    rng: ChaCha8Rng,
}

fn network(contextual: bool, params: &mut Params) -> candle_core::Result<Box<dyn GesturePredictor>> {
    let config = Config { vocabulary: VOCABULARY, ..Config::default() };
    Ok(match contextual {
        true => Box::new(ContextSeq2Seq::new(params, &config)?),
        false => Box::new(WordsSeq2Seq::new(params, &config)?),
    })
}

/// Inputs of `batch` segments.
fn segment(contextual: bool, batch: usize, config: &Config) -> candle_core::Result<Segment> {
    let numbers = |shape: &[usize], phase| pattern(shape, phase)?.to_dtype(DType::F32);
    let shape = match contextual {
        true => vec![batch, config.predicted, WORDS[1]],
        false => vec![batch, WORDS[0]],
    };
    let n: usize = shape.iter().product();
    let words: Vec<u32> = (0..n as u32).map(|i| i.wrapping_mul(2_654_435_761) % VOCABULARY as u32).collect();
    Ok(Segment {
        audio: numbers(&[batch, config.audio_frames(), config.audio], 1.0)?,
        previous: numbers(&[batch, config.previous, config.pose], 2.0)?,
        words: Some(Tensor::from_vec(words, shape, &Device::Cpu)?),
    })
}

impl FixedBatch {
    fn new(args: &Args) -> Result<Self> {
        let mut params = Params::new(1);
        let network = network(args.contextual, &mut params)?;
        let config = network.config();
        let target = pattern(&[args.batch, config.predicted, config.pose], 3.0)?.to_dtype(DType::F32)?;
        let segment = segment(args.contextual, args.batch, config)?;
        let adam = Adam::new(&params, adam::Config::default())?;
        Ok(Self { network, params, adam, segment, target, rng: ChaCha8Rng::seed_from_u64(0) })
    }

    /// Weights and batch as input of the reference.
    fn contents(&self, args: &Args, n_threads: usize) -> Result<Contents> {
        let config = self.network.config();
        let settings = [usize::from(args.contextual), config.context, config.predicted, n_threads].map(|v| v as f32);
        let words = self.segment.words.as_ref().context("no words")?.to_dtype(DType::F32)?;
        let mut tensors = BTreeMap::from([
            ("audio".to_owned(), self.segment.audio.clone()),
            ("previous".to_owned(), self.segment.previous.clone()),
            ("target".to_owned(), self.target.clone()),
            ("words".to_owned(), words),
            ("settings".to_owned(), Tensor::new(&settings, &Device::Cpu)?),
        ]);
        tensors.extend(self.params.tensors()?.into_iter().map(|(name, tensor)| (format!("net.{name}"), tensor)));
        Ok(Contents { facts: json!({}), tensors })
    }

    /// Seconds for `steps` steps.
    fn train(&mut self, steps: usize) -> Result<f64> {
        let start = Instant::now();
        for _ in 0..steps {
            let poses = self.network.forward(&self.segment, &mut Mode::Train(&mut self.rng))?;
            let loss = losses::total(&Seq2seqSettings::default(), &poses, &self.target, None)?;
            self.adam.step(&loss.backward()?, LEARNING_RATE)?;
        }
        Ok(start.elapsed().as_secs_f64())
    }

    /// Largest difference of the poses, relative to the largest pose value.
    fn pose_difference(&self, theirs: &mut Reference) -> Result<f64> {
        let their: Vec<f64> = serde_json::from_value(theirs.ask("forward")?["poses"].clone())?;
        let own = self.network.forward(&self.segment, &mut Mode::Eval)?.flatten_all()?.to_vec1::<f32>()?;
        ensure!(own.len() == their.len(), "the reference returned {} numbers, expected {}", their.len(), own.len());
        let scale = their.iter().fold(1e-9f64, |largest, v| largest.max(v.abs()));
        Ok(own.iter().zip(&their).map(|(own, their)| (f64::from(*own) - their).abs() / scale).fold(0.0, f64::max))
    }

    /// Seconds of motion generated per second on one thread with these weights.
    fn times_real_time(&self, contextual: bool) -> Result<f64> {
        let mut params = Params::frozen();
        let network = network(contextual, &mut params)?;
        params.load(&self.params.tensors()?)?;
        let config = network.config();
        let n_frames = SEGMENTS * config.predicted;
        let one = segment(contextual, 1, config)?;
        let audio = pattern(&[1, n_frames + config.context - 1, config.audio], 1.0)?.to_dtype(DType::F32)?;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        let secs = (0..3).map(|_| {
            let start = Instant::now();
            pool.install(|| {
                generate(&*network, &audio, &one.previous, StateAtSeams::Renewed, |_| Ok(one.words.clone()))
            })?;
            Ok(start.elapsed().as_secs_f64())
        });
        Ok(n_frames as f64 / FPS / median(secs.collect::<Result<_>>()?))
    }
}

pub(crate) fn run(args: &Args, progress: &dyn Progress) -> Result<Report> {
    ensure!(args.rounds > 0 && args.steps > 0 && args.batch > 1, "rounds, steps and two segments a batch at least");
    let n_threads = rayon::current_num_threads();
    let mut ours = FixedBatch::new(args)?;
    let file = std::env::temp_dir().join(format!("orator-bench-{}.safetensors", std::process::id()));
    let start = |script| Reference::start(script, n_threads, &ours.contents(args, n_threads)?, &file);
    let theirs = args.python.as_deref().map(start).transpose();
    let _ = std::fs::remove_file(&file);
    let mut theirs = theirs?;
    let difference = theirs.as_mut().map(|theirs| ours.pose_difference(theirs)).transpose()?;
    let task = progress.begin("seq2seq", args.rounds as u64);
    let (mut own, mut their) = (vec![], vec![]);
    for _ in 0..args.rounds {
        own.push(ours.train(args.steps)? / args.steps as f64);
        if let Some(theirs) = &mut theirs {
            their.push(theirs.secs(&format!("step {}", args.steps))? / args.steps as f64);
        }
        task.advance(1);
    }
    drop(task);
    let (peak, speed) = (own_peak_mib(), ours.times_real_time(args.contextual)?);
    let mut text = format!(
        "{}, batch {}, {n_threads} threads, median of {} rounds of {} steps\n\
         this program {:9.1} ms a step, peak memory {peak:6.0} MiB; generates {speed:.0} x real time on one thread",
        if args.contextual { "contextual" } else { "words" },
        args.batch,
        args.rounds,
        args.steps,
        1e3 * median(own.clone())
    );
    let mut facts = json!({ "contextual": args.contextual, "batch": args.batch, "threads": n_threads,
        "secs_a_step": median(own.clone()), "peak_mib": peak, "times_real_time": speed });
    if let (Some(theirs), Some(difference)) = (&mut theirs, difference) {
        let memory = theirs.ask("memory")?["peak_mib"].as_f64().unwrap_or(f64::NAN);
        let ratio = median(own.iter().zip(&their).map(|(own, their)| own / their).collect());
        text += &format!(
            "\nPyTorch {:9}{:9.1} ms a step, peak memory {memory:6.0} MiB\n\
             this program takes {ratio:.2} of PyTorch's time and {:.2} of its memory; poses {difference:.1e} apart",
            theirs.version(),
            1e3 * median(their.clone()),
            peak / memory
        );
        facts["pytorch"] = json!({ "version": theirs.version(), "secs_a_step": median(their), "peak_mib": memory,
            "ratio": ratio, "memory_ratio": peak / memory, "outputs_apart": difference });
    }
    Ok(Report { text, facts })
}
