//! `orator evaluate`, and its verb `compare` for two results.

use super::speakers;
use crate::cli::Outcome;
use crate::cli::config_args::{ConfigArgs, DeviceArgs, split};
use crate::cli::sandbox::enter_sandbox;
use crate::cli::train::stopped::same_command;
use crate::cli::ui::Ui;
use anyhow::{Result, bail, ensure};
use orator_base::stage::workdir::{self, FolderLock};
use orator_base::types::device::DeviceChoice;
use orator_base::types::time::FrameRate;
use orator_dataset::{Dataset, Split};
use orator_formats::word_vectors::WordVectors;
use orator_gesture::evaluate::Evaluation;
use orator_gesture::evaluate::clips::checkpoint::EvaluatedCheckpoint;
use orator_gesture::evaluate::clips::motion_store::{MEMORY_BYTES, MotionStore};
use orator_gesture::evaluate::conclusion::text;
use orator_gesture::evaluate::table::result::StoredResult;
use orator_gesture::evaluate::table::{compare, result};
use orator_gesture::generate::model::model_lock;
use orator_gesture::generate::seq2seq::metadata::cpu_only;
use orator_gesture::metrics::settings::Convention;
use orator_gesture::metrics::settings::MetricSettings;
use orator_nn::device::Device;
use orator_report::evaluation::page;
use serde::Deserialize as _;
use serde::de::IntoDeserializer as _;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::Arc;

/// Measure predicted motion against the ground truth and baselines.
///
/// The prediction is a file or folder of motion (.npy, .npz, also of SMPL-X, .txt of Rebol et al. 2021, .bvh), or the
/// output of checkpoints on a split of a dataset.
///
/// Each metric is printed with its 95 % confidence interval, next to the values of the baselines: static poses,
/// nearest neighbour, mismatched motion, and the ground truth itself. A summary states whether the prediction is
/// better than a static pose and whether it depends on the audio.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct Args {
    #[command(subcommand)]
    mode: Option<EvaluateMode>,
    #[command(flatten)]
    motion: MotionArgs,
}

#[derive(clap::Subcommand)]
enum EvaluateMode {
    Compare(CompareArgs),
}

#[derive(clap::Args)]
struct MotionArgs {
    /// Ground-truth motion: a file, or a folder of files that are paired by name.
    #[arg(long, value_name = "PATH")]
    truth: Option<PathBuf>,
    /// Predicted motion for the same audio: a file or a folder. Both may be in one folder: gt_interval_7.txt is
    /// paired with prediction_interval_7.txt.
    #[arg(long, value_name = "PATH", requires = "truth")]
    prediction: Option<PathBuf>,
    /// Audio file or folder, for beat metrics and the nearest neighbour.
    #[arg(long, value_name = "PATH", requires = "truth")]
    audio: Option<PathBuf>,
    /// Frame rate of files that do not state one (.npy, .txt), such as 15 or 30000/1001; defaults to 15.
    #[arg(long, value_name = "RATE", requires = "truth")]
    input_fps: Option<FrameRate>,
    /// Dataset folder of `orator run` or `orator import`, instead of files.
    #[arg(long, value_name = "DIR", conflicts_with = "truth", requires = "checkpoint")]
    dataset: Option<PathBuf>,
    /// Checkpoints of `orator train gan` and `orator train seq2seq`, or their folders (the best checkpoint is used,
    /// else the newest); all are reported in one table.
    #[arg(long, value_name = "FILE|DIR", requires = "dataset", num_args = 1..)]
    checkpoint: Vec<PathBuf>,
    /// Table of word vectors for words of the dataset that did not occur in training.
    #[arg(long, value_name = "FILE", requires = "checkpoint")]
    words: Option<PathBuf>,
    /// Keep the decoder state of sequence-to-sequence networks across segments.
    #[arg(long, requires = "checkpoint")]
    carry_state: bool,
    /// Configured speaker, or `all`: prints the PCK of each speaker's model on its own dataset.
    #[arg(long, value_name = "NAME|all", conflicts_with_all = ["truth", "dataset", "report", "all"])]
    speaker: Option<String>,
    /// Configuration file with the speakers of --speaker.
    #[arg(short, long, value_name = "FILE", default_value = "pipeline.toml", requires = "speaker")]
    config: PathBuf,
    /// Split of the dataset: train, validation or test.
    #[arg(long, value_name = "SPLIT", default_value = "validation", value_parser = split)]
    split: Split,
    /// Metric definitions: orator, speech2gesture, genea, emage, trimodal or aist.
    #[arg(long, value_name = "NAME", default_value = "orator", value_parser = convention)]
    convention: Convention,
    /// PCK thresholds, as fractions of the extent of the pose.
    #[arg(long, value_name = "FRACTION", num_args = 1.., default_values_t = [0.2, 0.1])]
    alpha: Vec<f64>,
    /// Also report errors and speeds over all 49 joints, including the static neck.
    #[arg(long)]
    with_neck: bool,
    /// Print all metrics, including those of arms, fingers and wrists (--json and --report always contain them).
    #[arg(long)]
    all: bool,
    /// Also write an HTML page with the table, plots, and truth and prediction played side by side with the audio.
    #[arg(long, value_name = "PAGE.html")]
    report: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArgs,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let MotionArgs { report, dataset, checkpoint, speaker, config, split, device, .. } = &args.motion;
    if let Some(which) = speaker {
        let folders = speakers::folders(&ConfigArgs { config: config.clone(), set: Vec::new() }, which)?;
        let device = device.open(DeviceChoice::Cpu, || None, ui)?;
        if device.is_cpu() {
            enter_sandbox(None, speakers::locked(&folders));
        }
        return speakers::run(&folders, *split, &settings(&args.motion), &device, ui);
    }
    let device = device.open(DeviceChoice::Cpu, || cpu_only(checkpoint.iter().map(PathBuf::as_path)), ui)?;
    if device.is_cpu() {
        enter_sandbox(report.as_deref(), dataset.iter().chain(checkpoint).map(PathBuf::as_path));
    }
    match args.mode {
        Some(EvaluateMode::Compare(args)) => compare_results(&args, ui),
        None => motion(&args.motion, &device, ui),
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
    ensure!(is_page, "--report {}: expected a file that ends in .html", path.display());
    ensure!(!path.is_dir(), "--report {} is a folder, expected a file", path.display());
    Ok(())
}

fn motion(args: &MotionArgs, device: &Device, ui: &Ui) -> Result<Outcome> {
    check_report(args)?;
    // The folder of a dataset is writable in the sandbox because it contains the dataset's lock.
    let in_dataset = |folder: &PathBuf| MotionStore::in_folder(folder, MEMORY_BYTES);
    let store = args.dataset.as_ref().map_or_else(MotionStore::in_memory, in_dataset);
    // The page lists its inputs, so the locks prevent `orator forget` from removing them before the page is written.
    let _dataset = args.dataset.as_deref().map(FolderLock::shared).transpose()?;
    let _models: Vec<FolderLock> = args.checkpoint.iter().map(|path| model_lock(path)).collect::<Result<_>>()?;
    let evaluation = evaluation(args, device, &store, ui)?;
    let table = evaluation.measure(&settings(args), ui)?;
    let mut facts: Value = result::json(&table);
    if let Some(words) = &args.words {
        facts["words"] = json!(words);
    }
    if args.carry_state {
        facts["carry_state"] = json!(true);
    }
    let mut text = text::text(&table, args.all);
    if let Some(path) = &args.report {
        let title = format!("Evaluation of {}", title(args));
        let html = page::html(&table, &evaluation.clips, &title, None)?;
        workdir::write_file(path, html.as_bytes())?;
        text += &format!("\nwrote {} ({:.1} MB)\n", path.display(), html.len() as f64 / 1e6);
        facts["report"] = json!(path);
    }
    let next = match &args.report {
        Some(path) => format!("xdg-open {}", path.display()),
        None => format!("{} --report evaluation.html", same_command()),
    };
    ui.summary(&text, Some(&next), facts);
    Ok(Outcome::Done)
}

fn settings(args: &MotionArgs) -> MetricSettings {
    MetricSettings {
        convention: args.convention,
        alphas: args.alpha.clone(),
        with_neck: args.with_neck,
        ..MetricSettings::default()
    }
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
fn evaluation(args: &MotionArgs, device: &Device, store: &MotionStore, ui: &Ui) -> Result<Evaluation> {
    if let Some(dataset) = &args.dataset {
        let dataset = Dataset::open(dataset)?;
        let mut checkpoints = EvaluatedCheckpoint::open_all_on(&args.checkpoint, &dataset.info().speaker, device)?;
        let words = args.words.as_deref().map(WordVectors::open).transpose()?.map(Arc::new);
        EvaluatedCheckpoint::set_options(&mut checkpoints, words.as_ref(), args.carry_state)?;
        return Evaluation::of_generators(&dataset, &checkpoints, args.split, store, ui);
    }
    let (Some(truth), Some(prediction)) = (&args.truth, &args.prediction) else {
        bail!("nothing to measure: give --truth and --prediction, --dataset and --checkpoint, or --speaker")
    };
    Evaluation::from_files(truth, prediction, args.audio.as_deref(), args.input_fps, store, ui)
}

/// Compare two results, and reject values that are not comparable.
///
/// Each value of a result has a hash of its definition and parameters. Values with equal hashes are printed next to
/// each other; for a metric whose hashes differ, the differing parameters are printed.
///
/// Exit code 1: a metric was rejected.
#[derive(clap::Args)]
struct CompareArgs {
    /// JSON output of `orator evaluate --json`.
    #[arg(value_name = "A.json")]
    a: PathBuf,
    /// JSON output to compare with.
    #[arg(value_name = "B.json")]
    b: PathBuf,
}

fn compare_results(args: &CompareArgs, ui: &Ui) -> Result<Outcome> {
    let compared = compare::compare(&StoredResult::read(&args.a)?, &StoredResult::read(&args.b)?);
    let has_rejected = !compared.rejected.is_empty();
    if compared.pairs.is_empty() && !has_rejected {
        bail!("{} and {} have no metric in common", args.a.display(), args.b.display());
    }
    let text = format!("A: {}\nB: {}\n\n{}", args.a.display(), args.b.display(), compare::text(&compared));
    ui.summary(&text, None, json!({ "compared": compared }));
    Ok(if has_rejected { Outcome::CheckFailed } else { Outcome::Done })
}
