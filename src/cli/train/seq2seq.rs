//! `orator train seq2seq`.

use crate::cli::Outcome;
use crate::cli::config_args::ConfigArgs;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, bail};
use orator::dataset::Dataset;
use orator::formats::bvh::exponential_maps::JointMapping;
use orator::formats::word_vectors::WordVectors;
use orator::train::seq2seq::captures::CaptureFolder;
use orator::train::seq2seq::source::TrainingSource;
use orator::train::seq2seq::train;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Train a sequence-to-sequence network of FineMotion's entry to GENEA 2020.
///
/// Reads a dataset of `orator run` or `orator dataset import`, or a folder of captures (`NAME.bvh` with `NAME.wav` and,
/// where there is one, a transcript of that name), and trains with the settings of `[seq2seq]`. Checkpoints,
/// `metrics.jsonl` and TensorBoard events go to the output folder; started again, it goes on from the newest checkpoint
/// there and ends with the same bytes as a training that was never interrupted.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    config: ConfigArgs,
    /// The dataset.
    #[arg(long, value_name = "DIR", required_unless_present = "captures", conflicts_with = "captures")]
    dataset: Option<PathBuf>,
    /// Folder of captures.
    #[arg(long, value_name = "DIR")]
    captures: Option<PathBuf>,
    /// Capture to validate on, without ending; may be given several times.
    #[arg(long, value_name = "NAME", requires = "captures")]
    hold_out: Vec<String>,
    /// What a joint is called in the captures, `Spine3=Chest`, or that there is none, `Spine3=`; may be given several times.
    #[arg(long, value_name = "JOINT=NAME", requires = "captures")]
    joint: Vec<String>,
    /// Table of word vectors that words begin with.
    #[arg(long, value_name = "FILE")]
    words: Option<PathBuf>,
    /// Steps to train altogether, instead of `seq2seq.steps`.
    #[arg(long, value_name = "N")]
    steps: Option<usize>,
    /// Folder of the checkpoints.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let mut settings = args.config.load_or_default()?.settings.seq2seq;
    settings.steps = args.steps.unwrap_or(settings.steps);
    let vectors = args.words.as_deref().map(WordVectors::open).transpose()?;
    let start = Instant::now();
    let train = |source| train::train(source, vectors.as_ref(), &settings, &args.out, ui);
    let outcome = match (&args.dataset, &args.captures) {
        (Some(folder), _) => {
            let dataset = Dataset::open(folder).context("`orator run` makes the dataset to train on")?;
            train(TrainingSource::Dataset(&dataset))?
        }
        (None, Some(folder)) => {
            let captures = CaptureFolder::open(folder, &args.hold_out, JointMapping::parse(&args.joint)?)?;
            train(TrainingSource::Captures(&captures))?
        }
        (None, None) => bail!("give --dataset or --captures"),
    };
    let steps_per_sec = (outcome.steps - outcome.began_at) as f64 / start.elapsed().as_secs_f64().max(1e-9);
    let validation = &outcome.validation;
    let mut text = format!(
        "{} steps{} ({steps_per_sec:.2} a second) on {} segments, {} words, {} parameters\n\
         on {} {} segments: L1 {:.3} (mean pose {:.3}), motion energy / data's {:.2}\n\
         newest checkpoint  {}\nbest (step {})  {}",
        outcome.steps,
        if outcome.stopped_early { ", ended early: the score had stopped falling" } else { "" },
        outcome.n_segments,
        outcome.n_words,
        outcome.n_parameters,
        validation.n_segments,
        validation.split,
        validation.l1,
        validation.mean_pose_l1,
        validation.energy,
        outcome.newest.display(),
        outcome.best_step,
        outcome.best.display(),
    );
    if let Some(alarm) = &validation.alarm {
        text += &format!("\nALARM: {alarm}");
    }
    let next = format!("orator generate --checkpoint {} --audio speech.wav --out motion.bvh", outcome.best.display());
    let facts = json!({
        "steps": outcome.steps,
        "stopped_early": outcome.stopped_early,
        "steps_per_sec": steps_per_sec,
        "segments": outcome.n_segments,
        "words": outcome.n_words,
        "parameters": outcome.n_parameters,
        "validation": validation,
        "newest": outcome.newest,
        "best": outcome.best,
        "best_step": outcome.best_step,
    });
    ui.summary(&text, Some(&next), facts);
    Ok(Outcome::Done)
}
