//! `orator-lab train lifter`.

use crate::mocap::upper_body;
use crate::train::lifter::body::BodyLifterTask;
use crate::train::lifter::hands::HandLifterTask;
use crate::train::lifter::heatmaps::HeatmapLifterTask;
use crate::train::supervised::{Schedule, TrainingTask, start_from, train};
use anyhow::{Context, ensure};
use orator::cli::Outcome;
use orator::cli::config_args::DeviceArgs;
use orator::cli::ui::Ui;
use orator_base::types::device::DeviceChoice;
use orator_nn::lifter::body::BodyLifter;
use orator_nn::lifter::temporal::CPU_ONLY;
use std::path::PathBuf;

/// Train the networks that lift 2D keypoints to 3D joints.
///
/// The body lifter is trained on captured motion (--mocap) and on procedural gestures, projected by random cameras;
/// the hand lifter on procedural hands. An interrupted training resumes when the same command is given again. At the
/// end the errors on held-out motion are printed next to those of trivial baselines.
#[derive(clap::Args)]
pub struct Args {
    /// Lifter to train.
    #[arg(long, value_enum)]
    part: LifterPart,
    /// hands: network architecture.
    #[arg(long, value_enum, default_value = "coordinates")]
    network: HandNetwork,
    /// body: captured motion to train on: .bvh or .npz files, or folders of them; may be repeated.
    #[arg(long, value_name = "PATH", num_args = 1..)]
    mocap: Vec<PathBuf>,
    /// body: takes to hold out from training and measure on, by name: patterns such as 'test_*' or 'walk#1' (the
    /// second take of a file).
    #[arg(long, value_name = "PATTERN", num_args = 1..)]
    hold_out: Vec<String>,
    /// Weights file to write (safetensors).
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Initialise from these weights instead of from the seed; with `--steps 0` their errors are measured and nothing
    /// is written.
    #[arg(long, value_name = "FILE")]
    start: Option<PathBuf>,
    /// Number of training steps.
    #[arg(long, default_value_t = 9000)]
    steps: usize,
    /// Batch size, samples.
    #[arg(long, default_value_t = 512)]
    batch: usize,
    /// Peak learning rate.
    #[arg(long, default_value_t = 2e-3)]
    learning_rate: f64,
    /// body: kernel widths, odd; their product is the receptive field in frames, at 15 fps.
    #[arg(long, value_name = "N", num_args = 1.., default_values_t = [3, 3, 3])]
    widths: Vec<usize>,
    /// Number of channels of the network; defaults to 256 for body and 896 for hands.
    #[arg(long, hide_default_value = true)]
    width: Option<usize>,
    /// Random seed; equal seeds give equal weights.
    #[arg(long, default_value_t = 1337)]
    seed: u64,
    /// Number of steps between checkpoints.
    #[arg(long, default_value_t = 250)]
    checkpoint_every: usize,
    #[command(flatten)]
    device: DeviceArgs,
}

/// Lifter whose networks are trained.
#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
pub enum LifterPart {
    Body,
    Hands,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum HandNetwork {
    /// Multi-layer perceptron on the keypoint coordinates, the kind of the built-in weights.
    Coordinates,
    /// Convolutional network on score maps (Zimmermann & Brox 2017); slow.
    Heatmap,
}

pub fn run(args: Args, ui: &Ui) -> anyhow::Result<Outcome> {
    ensure!(
        args.learning_rate > 0.0 && args.learning_rate < 1.0,
        "invalid --learning-rate {}: expected a value between 0 and 1",
        args.learning_rate
    );
    ensure!((1..=4096).contains(&args.width.unwrap_or(256)), "invalid --width: expected 1 to 4096");
    let cpu_only = || CPU_ONLY.filter(|_| args.part == LifterPart::Body);
    let device = args.device.open(DeviceChoice::Cpu, cpu_only, ui)?;
    let mut training_task: Box<dyn TrainingTask> = match args.part {
        LifterPart::Body => {
            ensure!(!args.mocap.is_empty(), "no training motion for the body lifter; give --mocap PATH");
            ensure!(
                args.widths.iter().all(|w| w % 2 == 1) && args.widths.iter().product::<usize>() <= 729,
                "invalid --widths {:?}: expected odd numbers whose product is at most 729",
                args.widths
            );
            let takes = upper_body::read_all(&args.mocap).context("cannot read --mocap")?;
            let (held_out, takes) = upper_body::divide(takes, &args.hold_out)?;
            ensure!(!takes.is_empty(), "--hold-out selects every take: expected at least one take for training");
            let config = BodyLifter::config(args.width.unwrap_or(256), &args.widths);
            Box::new(BodyLifterTask::new(takes, held_out, &config, args.seed, &device)?)
        }
        LifterPart::Hands => {
            ensure!(
                args.mocap.is_empty() && args.hold_out.is_empty(),
                "--mocap and --hold-out apply to `--part body` only; the hand lifter is trained on procedural hands"
            );
            match args.network {
                HandNetwork::Coordinates => {
                    Box::new(HandLifterTask::new(args.width.unwrap_or(896), args.seed, &device)?)
                }
                HandNetwork::Heatmap => Box::new(HeatmapLifterTask::new(args.seed, &device)?),
            }
        }
    };
    let started_from = args.start.as_deref().map(|path| start_from(&*training_task, path)).transpose()?;
    let schedule = Schedule {
        steps: args.steps,
        batch: args.batch,
        learning_rate: args.learning_rate,
        seed: args.seed,
        checkpoint_every: args.checkpoint_every,
        started_from,
    };
    let errors = train(&mut *training_task, &schedule, &args.out, ui)?;
    if schedule.steps == 0 {
        ui.summary(&errors.join("\n"), None, serde_json::json!({ "errors": errors }));
        return Ok(Outcome::Done);
    }
    let text = format!("wrote {}\n{}", args.out.display(), errors.join("\n"));
    let key = if args.part == LifterPart::Body { "--body-weights" } else { "--hand-weights" };
    let next = format!("orator lift KEYPOINTS.npz --out JOINTS.npy {key} {}", args.out.display());
    let facts =
        serde_json::json!({ "out": args.out, "parameters": training_task.params().n_parameters(), "errors": errors });
    ui.summary(&text, Some(&next), facts);
    Ok(Outcome::Done)
}
