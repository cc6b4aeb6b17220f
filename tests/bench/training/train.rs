//! `cargo bench -- train`: a step of the GAN trainer, compared with PyTorch for the same networks, batch, losses and
//! optimiser: time, peak memory and difference of the results; and the time of each phase of a step.

use super::super::child::own_peak_mib;
use super::super::reference::Reference;
use super::super::report::{Report, median};
use anyhow::{Context, Result, ensure};
use candle_core::{Device, Tensor};
use orator_base::audio::mel::N_MELS;
use orator_base::stage::progress::Progress;
use orator_base::types::device::DeviceChoice;
use orator_base::types::skeleton::{N_BONES, N_JOINTS, NECK, is_duplicate, parent};
use orator_base::types::time::FrameRate;
use orator_dataset::config::{AdversarialLoss, GanConfig, GanRecipe, MotionRepresentation};
use orator_formats::checkpoint;
use orator_gesture::generate::generator::mel_frames;
use orator_gesture::generate::model::SpeakerMetadata;
use orator_gesture::generate::normalisation::{N_FEATURES, Normalisation};
use orator_gesture::generate::representation::Representation;
use orator_gesture::train::gan::recipe::{self, InitialWeights, TrainingMaterial};
use orator_gesture::train::gan::step::{GanTrainer, Losses, MAX_NORM};
use orator_gesture::train::gan::windows::WindowBatch;
use orator_nn::cpu::spin_pool::with_spinning_workers;
use orator_nn::device;
use orator_nn::gan::generator::Config;
use orator_nn::weights::Contents;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

const FPS: FrameRate = FrameRate::new(15, 1);
/// Fraction of joints that are missing in the batch.
const MISSING: f64 = 0.1;
/// Stride of the compared outputs.
const OUTPUT_STRIDE: usize = 97;

/// A step of the GAN trainer on all cores: time, peak memory, time per phase and, with `--python`, comparison with
/// PyTorch. Both train the same networks on the same batch: forward kinematics, L1 over the joints that are not
/// missing, least-squares adversarial loss, gradient clipping, Adam.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Network preset: `light` or `paper`.
    #[arg(long, default_value = "light", value_name = "NAME")]
    preset: String,
    /// Windows per step.
    #[arg(long, default_value_t = 32, value_name = "N")]
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
    /// Device of both.
    #[arg(long, default_value = "cpu", value_name = "cpu|cuda|cuda:N")]
    device: DeviceChoice,
    /// Compares the losses of this many steps on the device and on the CPU instead of measuring.
    #[arg(long, value_name = "N")]
    beside_cpu: Option<usize>,
}

/// The trainer with a constant batch.
struct FixedBatch {
    trainer: GanTrainer,
    batch: WindowBatch,
}

impl FixedBatch {
    fn new(args: &Args, device: &Device) -> Result<Self> {
        let preset = serde_json::from_value(json!(args.preset))?;
        let config = GanConfig {
            recipe: GanRecipe::Rebol2021,
            preset,
            representation: MotionRepresentation::Bones,
            adversarial: AdversarialLoss::LeastSquares,
            batch: args.batch.into(),
            ..GanConfig::default()
        };
        let settings = recipe::settings(
            &config,
            &TrainingMaterial { train_secs: 0.0, validation_secs: 0.0, n_speakers: 1 },
            InitialWeights::Random,
        )?;
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let table = |value: f32| ndarray::Array2::from_elem((N_JOINTS, 3), value);
        let length = |joint: usize| if is_duplicate(joint) { 0.0 } else { 0.1 };
        let normalisation = Normalisation::new(&table(0.1), &table(0.3), (1..N_JOINTS).map(length).collect());
        let mut numbers = |low: f32, high: f32, n: usize| (0..n).map(|_| rng.random_range(low..high)).collect();
        let representation =
            Representation::Bones { mean: numbers(-0.5, 0.5, N_FEATURES), std: numbers(0.1, 0.4, N_FEATURES) };
        // The same momentum as in the reference, although running statistics are not compared.
        let network = Config { norm_momentum: 0.1, ..Config::from_preset(args.preset.parse()?, N_FEATURES) };
        let (n_mels, n_frames) = (mel_frames(FPS, settings.window_frames), settings.window_frames);
        let tensor = |values: Vec<f32>, rows: usize, columns: usize| {
            Tensor::from_vec(values, (args.batch, rows, columns), &Device::Cpu)
        };
        let mels = tensor(numbers(-1.0, 1.0, args.batch * N_MELS * n_mels), N_MELS, n_mels)?;
        let poses: Vec<f32> = numbers(-1.0, 1.0, args.batch * N_FEATURES * n_frames);
        let mut is_visible = |i: usize| !is_duplicate(i / n_frames % N_BONES + 1) && rng.random_bool(1.0 - MISSING);
        let joints: Vec<bool> = (0..args.batch * N_BONES * n_frames).map(&mut is_visible).collect();
        let rows = joints.chunks_exact(n_frames).flat_map(|row| [row; 3]).flatten();
        let mask: Vec<f32> = rows.map(|visible| f32::from(*visible)).collect();
        let poses = poses.iter().zip(&mask).map(|(number, mask)| number * mask).collect();
        let batch = WindowBatch {
            mels,
            poses: tensor(poses, N_FEATURES, n_frames)?,
            mask: tensor(mask, N_FEATURES, n_frames)?,
            speakers: vec![0; args.batch],
            words: None,
        };
        let facts = SpeakerMetadata::new("benchmark", FPS, "", network, normalisation, representation);
        Ok(Self { trainer: GanTrainer::new(vec![facts], settings, device)?, batch })
    }

    /// Weights, batch and settings as input of the reference.
    fn contents(&self, folder: &Path) -> Result<Contents> {
        self.trainer.save(folder)?;
        let mut contents = Contents::read(&checkpoint::path(folder, 0))?;
        let settings = &self.trainer.settings;
        let SpeakerMetadata { normalisation, representation, .. } = &self.trainer.speakers.all()[0];
        let Representation::Bones { mean, std } = representation else { anyhow::bail!("no bones to compare") };
        let parents: Vec<f32> = (1..N_JOINTS).map(|joint| parent(joint).unwrap_or(NECK) as f32).collect();
        let numbers = [settings.lambda_l1, settings.lambda_gan, settings.learning_rate, MAX_NORM];
        let vectors = [
            ("direction_mean", mean),
            ("direction_std", std),
            ("pose_mean", &normalisation.mean),
            ("pose_std", &normalisation.std),
            ("bone_lengths", &normalisation.bone_lengths),
            ("parents", &parents),
            ("settings", &numbers.map(|v| v as f32).to_vec()),
        ];
        for (name, values) in vectors {
            contents.tensors.insert(name.to_owned(), Tensor::new(&values[..], &Device::Cpu)?);
        }
        for (name, tensor) in [("mels", &self.batch.mels), ("poses", &self.batch.poses), ("mask", &self.batch.mask)] {
            contents.tensors.insert(name.to_owned(), tensor.clone());
        }
        Ok(contents)
    }

    /// Seconds for `steps` steps, and the losses of the last one.
    fn train(&mut self, steps: usize) -> Result<(f64, Losses)> {
        with_spinning_workers(|| {
            let start = Instant::now();
            for _ in 1..steps {
                self.trainer.step(&self.batch)?;
            }
            let losses = self.trainer.step(&self.batch)?;
            self.trainer.device().synchronize()?;
            Ok((start.elapsed().as_secs_f64(), losses))
        })
    }

    /// Time of each phase of a step, seconds.
    fn phases(&mut self) -> Result<Vec<(&'static str, f64)>> {
        let (mut phases, mut last) = (Vec::new(), Instant::now());
        let device = self.trainer.device().clone();
        let mut phase = |name| {
            let _ = device.synchronize();
            phases.push((name, last.elapsed().as_secs_f64()));
            last = Instant::now();
        };
        with_spinning_workers(|| self.trainer.step_in_phases(&self.batch, &mut phase))?;
        Ok(phases)
    }

    /// Largest difference of the generated poses, relative to the largest pose value, and largest relative difference
    /// of the losses and the gradient norm of the first step.
    fn differences(&mut self, theirs: &mut Reference) -> Result<(f64, f64)> {
        let their: Vec<f64> = serde_json::from_value(theirs.ask("forward")?["poses"].clone())?;
        let mels = self.batch.mels.to_device(self.trainer.device())?;
        let raw = self.trainer.generator.forward(&mels, &[], self.trainer.settings.window_frames, true)?;
        let own = self.trainer.speakers.poses(&raw, &self.batch.speakers)?.flatten_all()?.to_vec1::<f32>()?;
        let n = own.len().div_ceil(OUTPUT_STRIDE);
        ensure!(their.len() == n, "the reference returned {} outputs, expected {n}", their.len());
        let scale = their.iter().fold(1e-9f64, |largest, v| largest.max(v.abs()));
        let outputs =
            own.iter().step_by(OUTPUT_STRIDE).zip(&their).map(|(own, their)| (f64::from(*own) - their).abs() / scale);
        let their: Vec<f64> = serde_json::from_value(theirs.ask("step 1")?["losses"].clone())?;
        let Losses { l1, adversarial, discriminator, gradient_norm, .. } = self.train(1)?.1;
        let own = [l1, adversarial, discriminator, gradient_norm];
        let losses = own.iter().zip(&their).map(|(own, their)| (own - their).abs() / their.abs());
        Ok((outputs.fold(0.0, f64::max), losses.fold(0.0, f64::max)))
    }
}

pub(crate) fn run(args: &Args, progress: &dyn Progress) -> Result<Report> {
    ensure!(
        args.rounds > 0 && args.steps > 0 && args.batch > 1,
        "nothing to measure: there must be rounds, steps and two windows a batch at least"
    );
    let folder = std::env::temp_dir().join(format!("orator-bench-{}", std::process::id()));
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot create the folder {}", folder.display()))?;
    let measured = measure(args, &folder, progress);
    let _ = std::fs::remove_dir_all(&folder);
    measured
}

/// Losses of each step on the device and on the CPU, from the same weights and batch.
fn beside_cpu(args: &Args, device: &Device, n_steps: usize) -> Result<Report> {
    let mut trainers = [FixedBatch::new(args, device)?, FixedBatch::new(args, &Device::Cpu)?];
    let mut text = format!(
        "{}: losses on {} and on the CPU, and their largest relative difference\n\
         step         L1               adversarial      discriminator",
        args.preset, args.device
    );
    let mut differences = Vec::new();
    for step in 1..=n_steps {
        let [own, cpu] = trainers.each_mut().map(|trainer| trainer.train(1));
        let [own, cpu] = [own?.1, cpu?.1].map(|losses| [losses.l1, losses.adversarial, losses.discriminator]);
        let difference = own.iter().zip(&cpu).map(|(own, cpu)| (own - cpu).abs() / cpu.abs()).fold(0.0, f64::max);
        differences.push(difference);
        if step == n_steps || [1, 2, 5, 10, 20, 50, 100].contains(&step) {
            let pairs: Vec<String> = own.iter().zip(&cpu).map(|(own, cpu)| format!("{own:.5} {cpu:.5}")).collect();
            text += &format!("\n{step:4}  {}  {difference:.1e}", pairs.join("  "));
        }
    }
    Ok(Report { text, facts: json!({ "preset": args.preset, "differences": differences }) })
}

/// Peak memory of the tensors on the device, or of this process on the CPU, MiB.
fn peak_mib(device: &Device) -> Result<f64> {
    #[cfg(feature = "cuda")]
    if let candle_core::DeviceLocation::Cuda { gpu_id } = device.location() {
        return Ok(orator_nn::cuda::gpu::peak_memory(gpu_id)? as f64 / f64::from(1 << 20));
    }
    ensure!(device.is_cpu(), "the memory of this device is not measured");
    Ok(own_peak_mib())
}

fn measure(args: &Args, folder: &Path, progress: &dyn Progress) -> Result<Report> {
    let (device, _) = device::open(args.device, || None)?;
    if let Some(n_steps) = args.beside_cpu {
        return beside_cpu(args, &device, n_steps);
    }
    let n_threads = rayon::current_num_threads();
    // Peak memory of training only, before the input of the reference is created.
    FixedBatch::new(args, &device)?.train(args.steps)?;
    let peak = peak_mib(&device)?;
    let mut ours = FixedBatch::new(args, &device)?;
    let start = |script| {
        let file = folder.join("given.safetensors");
        let mut theirs = Reference::start(script, n_threads, &ours.contents(folder)?, &file)?;
        theirs.ask(if device.is_cpu() { "device cpu" } else { "device cuda" })?;
        anyhow::Ok(theirs)
    };
    let mut theirs = args.python.as_deref().map(start).transpose()?;
    let differences = theirs.as_mut().map(|theirs| ours.differences(theirs)).transpose()?;

    let task = progress.begin("train", args.rounds as u64);
    let (mut own, mut their) = (vec![], vec![]);
    for _ in 0..args.rounds {
        own.push(ours.train(args.steps)?.0 / args.steps as f64);
        if let Some(theirs) = &mut theirs {
            their.push(theirs.secs(&format!("step {}", args.steps))? / args.steps as f64);
        }
        task.advance(1);
    }
    drop(task);
    let phases = ours.phases()?;

    let secs = median(own.clone());
    let mut text = format!(
        "{}: {} parameters, batch {}, {}, {n_threads} threads, median of {} rounds of {} steps\n\
         this program     {:9.1} ms a step, peak memory {peak:6.0} MiB",
        args.preset,
        ours.trainer.n_parameters(),
        args.batch,
        args.device,
        args.rounds,
        args.steps,
        1e3 * secs
    );
    let mut facts = json!({ "preset": args.preset, "batch": args.batch, "threads": n_threads, "secs_a_step": secs,
        "peak_mib": peak });
    if let (Some(theirs), Some((outputs, losses))) = (&mut theirs, differences) {
        let memory = theirs.ask("memory")?["peak_mib"].as_f64().unwrap_or(f64::NAN);
        let ratio = median(own.iter().zip(&their).map(|(own, their)| own / their).collect());
        text += &format!(
            "\nPyTorch {:9}{:9.1} ms a step, peak memory {memory:6.0} MiB\n\
             this program takes {ratio:.2} of PyTorch's time and {:.2} of its memory\n\
             poses at most {outputs:.1e} apart, over the largest; losses and gradient norm after one step {losses:.1e}",
            theirs.version(),
            1e3 * median(their.clone()),
            peak / memory
        );
        facts["pytorch"] = json!({ "version": theirs.version(), "secs_a_step": median(their),
            "peak_mib": memory, "ratio": ratio, "memory_ratio": peak / memory, "outputs_apart": outputs,
            "losses_apart": losses, "parts": theirs.ask("parts")? });
    }
    let total: f64 = phases.iter().map(|(_, secs)| secs).sum();
    for (name, secs) in &phases {
        text += &format!("\n  {name:22}{:9.1} ms {:5.1} %", 1e3 * secs, 100.0 * secs / total);
    }
    facts["parts"] = phases.into_iter().map(|(name, secs)| (name.to_owned(), json!(secs))).collect();
    Ok(Report { text, facts })
}
