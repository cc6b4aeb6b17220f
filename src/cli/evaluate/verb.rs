//! `orator evaluate`, and its verb `compare` for two results.

use crate::cli::Outcome;
use crate::cli::config_args::split;
use crate::cli::moved::MovedVerb;
use crate::cli::sandbox::enter_sandbox;
use crate::cli::ui::Ui;
use anyhow::{Result, bail, ensure};
use orator_base::stage::workdir::{self, FolderLock};
use orator_base::types::time::FrameRate;
use orator_dataset::{Dataset, Split};
use orator_gesture::evaluate::Evaluation;
use orator_gesture::evaluate::clips::checkpoint::EvaluatedCheckpoint;
use orator_gesture::evaluate::clips::motion_store::{MEMORY_BYTES, MotionStore};
use orator_gesture::evaluate::table::result::StoredResult;
use orator_gesture::evaluate::table::{compare, result};
use orator_gesture::evaluate::verdict::text;
use orator_gesture::generate::model::model_lock;
use orator_gesture::metrics::settings::Convention;
use orator_gesture::metrics::settings::MetricSettings;
use orator_report::evaluation::page;
use serde::Deserialize as _;
use serde::de::IntoDeserializer as _;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Measure predicted motion against the ground truth and baselines.
///
/// Files or folders of motion (.npy, .npz, the authors' .txt, .bvh), or checkpoints on a split of a dataset. Beside each
/// figure stands the same for poses that never move, the nearest neighbour, mismatched motion and the truth itself; with its
/// 95 % interval, and a plain sentence: is it better than doing nothing, and does it hear?
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct Args {
    #[command(subcommand)]
    what: Option<What>,
    #[command(flatten)]
    motion: MotionArgs,
}

#[derive(clap::Subcommand)]
enum What {
    Compare(CompareArgs),
    #[command(hide = true)]
    Lifter(MovedVerb),
    #[command(hide = true)]
    People(MovedVerb),
}

#[derive(clap::Args)]
struct MotionArgs {
    /// The real motion: a file, or a folder of files that are paired by name.
    #[arg(long, value_name = "PATH")]
    truth: Option<PathBuf>,
    /// The predicted motion of the same sound: a file or a folder (it may be the same one: gt_interval_7.txt belongs to
    /// prediction_interval_7.txt).
    #[arg(long, value_name = "PATH", requires = "truth")]
    prediction: Option<PathBuf>,
    /// The sound, a file or a folder: for the beats, and for the nearest neighbour.
    #[arg(long, value_name = "PATH", requires = "truth")]
    audio: Option<PathBuf>,
    /// Frames a second of files that do not say it themselves (.npy, .txt), like 15 or 30000/1001 [default: 15]
    #[arg(long, value_name = "RATE", requires = "truth")]
    fps: Option<FrameRate>,
    /// Instead of files: a dataset, a folder of `orator run` or `orator import`.
    #[arg(long, value_name = "DIR", conflicts_with = "truth", requires = "checkpoint")]
    dataset: Option<PathBuf>,
    /// Checkpoints of `orator train gan` and `orator train seq2seq`, or their folders (the best checkpoint, else the newest,
    /// is taken): all in one table.
    #[arg(long, value_name = "FILE|FOLDER", requires = "dataset", num_args = 1..)]
    checkpoint: Vec<PathBuf>,
    /// Which intervals of the dataset: validation, test or train.
    #[arg(long, value_name = "SPLIT", default_value = "validation", value_parser = split)]
    split: Split,
    /// Whose definitions: orator, speech2gesture, genea, emage, trimodal or aist.
    #[arg(long, value_name = "NAME", default_value = "orator", value_parser = convention)]
    convention: Convention,
    /// Shares of the pose's extent for correct keypoints (PCK).
    #[arg(long, value_name = "SHARE", num_args = 1.., default_values_t = [0.2, 0.1])]
    alpha: Vec<f64>,
    /// Also give errors and speeds over all 49 joints, the neck included, which stands still.
    #[arg(long)]
    with_neck: bool,
    /// Print every figure, those of arms, fingers and wrists too (--json and the page have all of them).
    #[arg(long)]
    all: bool,
    /// Also write one HTML page: the table, plots, and truth and prediction playing side by side with the sound.
    #[arg(long, value_name = "PAGE.html")]
    report: Option<PathBuf>,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let MotionArgs { report, dataset, checkpoint, .. } = &args.motion;
    enter_sandbox(report.as_deref(), dataset.iter().chain(checkpoint).map(PathBuf::as_path));
    match args.what {
        Some(What::Lifter(args)) => args.refuse("evaluate lifter"),
        Some(What::Compare(args)) => compare_results(&args, ui),
        Some(What::People(args)) => args.refuse("evaluate people"),
        None => motion(&args.motion, ui),
    }
}

fn convention(name: &str) -> std::result::Result<Convention, String> {
    let known = Convention::deserialize(name.into_deserializer());
    known.map_err(|error: serde::de::value::Error| error.to_string())
}

/// Checks that the report is an HTML file and does not overwrite an input.
fn check_report(args: &MotionArgs) -> Result<()> {
    let Some(path) = &args.report else { return Ok(()) };
    let is_page = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("html"));
    ensure!(is_page, "{}: a page ends in .html; name such a file", path.display());
    ensure!(!path.is_dir(), "{} is a folder; name a file in it", path.display());
    Ok(())
}

fn motion(args: &MotionArgs, ui: &Ui) -> Result<Outcome> {
    check_report(args)?;
    // The folder of a dataset is writable in the sandbox because it contains the dataset's lock.
    let in_dataset = |folder: &PathBuf| MotionStore::in_folder(folder, MEMORY_BYTES);
    let store = args.dataset.as_ref().map_or_else(MotionStore::in_memory, in_dataset);
    let settings = MetricSettings {
        convention: args.convention,
        alphas: args.alpha.clone(),
        with_neck: args.with_neck,
        ..MetricSettings::default()
    };
    // The page lists its inputs, so the locks prevent `orator forget` from removing them before the page is written.
    let _dataset = args.dataset.as_deref().map(FolderLock::shared).transpose()?;
    let _models: Vec<FolderLock> = args.checkpoint.iter().map(|path| model_lock(path)).collect::<Result<_>>()?;
    let evaluation = evaluation(args, &store, ui)?;
    let table = evaluation.measure(&settings, ui)?;
    let mut facts: Value = result::json(&table);
    let mut text = text::text(&table, args.all);
    if let Some(path) = &args.report {
        let title = format!("Evaluation of {}", title(args));
        let html = page::html(&table, &evaluation.clips, &title)?;
        workdir::write_file(path, html.as_bytes())?;
        text += &format!("\nwrote {} ({:.1} MB)\n", path.display(), html.len() as f64 / 1e6);
        facts["report"] = json!(path);
    }
    ui.summary(&text, None, facts);
    Ok(Outcome::Done)
}

/// Title of the evaluation: names of the inputs without folders of this machine.
fn title(args: &MotionArgs) -> String {
    let name = |path: &PathBuf| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    match (&args.dataset, &args.prediction) {
        (Some(dataset), _) => {
            let names: Vec<String> = args.checkpoint.iter().map(name).collect();
            format!("{} on the {} split of {}", names.join(" and "), args.split.name(), name(dataset))
        }
        (None, prediction) => prediction.as_ref().map(name).unwrap_or_default(),
    }
}

/// The evaluation of files or of a dataset.
fn evaluation(args: &MotionArgs, store: &MotionStore, ui: &Ui) -> Result<Evaluation> {
    if let Some(dataset) = &args.dataset {
        let dataset = Dataset::open(dataset)?;
        let checkpoints = EvaluatedCheckpoint::open_all(&args.checkpoint, &dataset.info().speaker)?;
        return Evaluation::of_generators(&dataset, &checkpoints, args.split, store, ui);
    }
    let (Some(truth), Some(prediction)) = (&args.truth, &args.prediction) else {
        bail!("nothing to measure: give --truth and --prediction, or --dataset and --checkpoint")
    };
    Evaluation::from_files(truth, prediction, args.audio.as_deref(), args.fps, store, ui)
}

/// Put two results side by side, and refuse what is not comparable.
///
/// Each value of a result holds the hash of its definition and parameters. Values of one hash are shown beside each other;
/// of a metric whose hashes differ it is said in which parameters, and the exit code is 1.
#[derive(clap::Args)]
struct CompareArgs {
    /// What `orator evaluate --json` wrote.
    #[arg(value_name = "A.json")]
    a: PathBuf,
    /// Another one.
    #[arg(value_name = "B.json")]
    b: PathBuf,
}

fn compare_results(args: &CompareArgs, ui: &Ui) -> Result<Outcome> {
    let compared = compare::compare(&StoredResult::read(&args.a)?, &StoredResult::read(&args.b)?);
    let is_refused = !compared.refused.is_empty();
    if compared.beside.is_empty() && !is_refused {
        bail!("{} and {} have no metric in common", args.a.display(), args.b.display());
    }
    let text = format!("A: {}\nB: {}\n\n{}", args.a.display(), args.b.display(), compare::text(&compared));
    ui.summary(&text, None, json!({ "compared": compared }));
    Ok(if is_refused { Outcome::Wrong } else { Outcome::Done })
}
