//! `orator-lab train embedding`.

use super::corpus;
use crate::train::space::embedding::EmbeddingTask;
use crate::train::supervised::{Schedule, start_from, train};
use anyhow::ensure;
use orator::cli::Outcome;
use orator::cli::ui::Ui;
use std::path::PathBuf;

/// Train the encoder for the Frechet gesture distance of `orator evaluate`.
///
/// An auto-encoder of windows of 34 frames is trained on captured motion (--mocap, with procedural hands) and on
/// procedural motion. A trained encoder is built into the program; values measured with another one are not
/// comparable with its own.
///
/// An interrupted training resumes when the same command is given again. At the end the errors on held-out windows
/// are printed next to those of the mean pose.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    corpus: corpus::CorpusArgs,
    /// Weights file to write (safetensors).
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Initialise from these weights instead of from the seed; with `--steps 0` their errors are measured and nothing
    /// is written.
    #[arg(long, value_name = "FILE")]
    start: Option<PathBuf>,
    /// Number of training steps.
    #[arg(long, default_value_t = 6000)]
    steps: usize,
    /// Batch size, windows.
    #[arg(long, default_value_t = 64)]
    batch: usize,
    /// Peak learning rate.
    #[arg(long, default_value_t = 2e-3)]
    learning_rate: f64,
    /// Number of steps between checkpoints.
    #[arg(long, default_value_t = 500)]
    checkpoint_every: usize,
}

pub fn run(args: Args, ui: &Ui) -> anyhow::Result<Outcome> {
    ensure!(
        args.learning_rate > 0.0 && args.learning_rate < 1.0,
        "invalid --learning-rate {}: expected a value between 0 and 1",
        args.learning_rate
    );
    let corpus = corpus::gather(&args.corpus, ui)?;
    let n_frames = corpus.n_frames();
    let mut training_task = EmbeddingTask::new(corpus, args.corpus.seed)?;
    let started_from = args.start.as_deref().map(|path| start_from(&training_task, path)).transpose()?;
    let schedule = Schedule {
        steps: args.steps,
        batch: args.batch,
        learning_rate: args.learning_rate,
        seed: args.corpus.seed,
        checkpoint_every: args.checkpoint_every,
        started_from,
    };
    let errors = train(&mut training_task, &schedule, &args.out, ui)?;
    let written = if args.steps == 0 { String::new() } else { format!("wrote {}\n", args.out.display()) };
    let text = format!(
        "{written}{n_frames} training frames; reconstruction errors of held-out windows:\n{}",
        errors.join("\n")
    );
    ui.summary(&text, None, serde_json::json!({ "out": args.out, "frames": n_frames, "errors": errors }));
    Ok(Outcome::Done)
}
