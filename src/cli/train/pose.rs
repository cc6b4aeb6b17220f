//! `orator train pose`.

use crate::cli::Outcome;
use crate::cli::confine::confine;
use crate::cli::ui::Ui;
use anyhow::{Result, ensure};
use orator::nn::pose::body::BodyNetConfig;
use orator::stage::workdir;
use orator::train::pose::body::BodyNetTask;
use orator::train::pose::export;
use orator::train::pose::people;
use orator::train::supervised::{Schedule, TrainingTask, start_from, train};
use std::path::PathBuf;

/// Train a small network that finds the points of a body in a picture, from labelled pictures.
///
/// The weights are written, and beside them the network as an ONNX file that the manifest of models runs. An
/// interrupted training goes on when the same command is given again. The errors printed are those on the set's part
/// `val`.
#[derive(clap::Args)]
pub struct Args {
    /// Labelled set in the form of COCO-WholeBody: images, annotations/coco_wholebody_{train,val}.json.
    #[arg(long, value_name = "DIR")]
    labels: PathBuf,
    /// The weights file to write (safetensors); the ONNX file has its name and the ending .onnx.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Start from these weights instead of the seed's; with `--steps 0` their errors are measured, and the ONNX file
    /// alone is written.
    #[arg(long, value_name = "FILE")]
    start: Option<PathBuf>,
    /// Training steps.
    #[arg(long, default_value_t = 6000)]
    steps: usize,
    /// Pictures a step.
    #[arg(long, default_value_t = 32)]
    batch: usize,
    /// The highest learning rate.
    #[arg(long, default_value_t = 2e-3)]
    learning_rate: f64,
    /// Seed of the random numbers; equal seeds give equal weights.
    #[arg(long, default_value_t = 1337)]
    seed: u64,
    /// Steps between two checkpoints.
    #[arg(long, default_value_t = 100)]
    checkpoint_every: usize,
}

pub fn run(args: &Args, ui: &Ui) -> Result<Outcome> {
    confine([args.out.as_path()], []);
    ensure!(args.learning_rate > 0.0 && args.learning_rate < 1.0, "--learning-rate must lie between 0 and 1");
    let (people, held_out) = (people::read(&args.labels, "train")?, people::read(&args.labels, "val")?);
    let mut training_task = BodyNetTask::new(people, held_out, &BodyNetConfig::default(), args.seed)?;
    let started_from = args.start.as_deref().map(|path| start_from(&training_task, path)).transpose()?;
    let schedule = Schedule {
        steps: args.steps,
        batch: args.batch,
        learning_rate: args.learning_rate,
        seed: args.seed,
        checkpoint_every: args.checkpoint_every,
        started_from,
    };
    let errors = train(&mut training_task, &schedule, &args.out, ui)?;
    let n_weights = training_task.params().n_parameters();
    let onnx = args.out.with_extension("onnx");
    workdir::write_file(&onnx, &export::onnx(training_task.net(), n_weights)?)?;
    let text = format!("{} written: {n_weights} weights\n{}", onnx.display(), errors.join("\n"));
    let next = format!("orator models add {} --like {}", onnx.display(), export::LIKE);
    let facts =
        serde_json::json!({ "out": args.out, "onnx": onnx, "parameters": n_weights, "errors": errors, "next": next });
    ui.summary(&text, Some(&next), facts);
    Ok(Outcome::Done)
}
