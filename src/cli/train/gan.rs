//! `orator train gan`.

use crate::cli::Outcome;
use crate::cli::config_args::ConfigArgs;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, bail};
use orator::config::Config;
use orator::dataset::index::SampleRef;
use orator::dataset::{Dataset, Split};
use orator::evaluate::baseline::predictor;
use orator::evaluate::clips::held_out;
use orator::evaluate::clips::held_out::HeldOutInterval;
use orator::generate::GestureGenerator;
use orator::report::training::page;
use orator::report::training::strip::HeldOutPair;
use orator::stage::progress::Progress as _;
use orator::train::gan::score::{Validation, ValidationMetrics};
use orator::train::gan::train;
use orator::types::time::FrameRate;
use serde_json::json;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Intervals on the page of a training, and how much of each is generated.
const N_PAIRS: usize = 3;
const PAIR_SECS: f64 = 8.0;

/// Train a speaker's speech-to-gesture generator.
///
/// Reads the dataset that `orator run` made and trains with the settings of `[gan]`, one model a speaker. Checkpoints,
/// `metrics.jsonl`, TensorBoard events and a page of curves go to the output folder; started again, it goes on from the
/// newest checkpoint there, with that checkpoint's settings, and ends with the same bytes as a training that was never
/// interrupted.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    config: ConfigArgs,
    /// The speaker; may be left out when the configuration names one only.
    #[arg(long, value_name = "NAME")]
    speaker: Option<String>,
    /// Steps to train altogether, instead of `gan.steps`.
    #[arg(long, value_name = "N")]
    steps: Option<usize>,
    /// Folder of the checkpoints; `work/gan/<speaker>` when left out.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// The dataset; `work/dataset/<speaker>` when left out.
    #[arg(long, value_name = "DIR")]
    dataset: Option<PathBuf>,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let config = if args.dataset.is_some() { args.config.load_or_default()? } else { args.config.load()? };
    let folder_of = |given: Option<PathBuf>, room: &str| -> Result<PathBuf> {
        match given {
            Some(path) => Ok(path),
            None => Ok(config.settings.work.dir.join(room).join(speaker(args.speaker.as_ref(), &config)?)),
        }
    };
    let (folder, out) = (folder_of(args.dataset, "dataset")?, folder_of(args.out, "gan")?);
    let mut settings = config.settings.gan.clone();
    settings.steps = args.steps.unwrap_or(settings.steps);
    let dataset = Dataset::open(&folder).context("`orator run` makes the dataset to train on")?;

    let start = Instant::now();
    let outcome = train::train(&dataset, &settings, &out, ui)?;
    let steps_per_sec = (outcome.steps - outcome.began_at) as f64 / start.elapsed().as_secs_f64().max(1e-9);
    let of_best = || pairs(&dataset, &GestureGenerator::open(&outcome.best)?);
    let page = page(&out, &dataset.info().speaker, of_best, ui);
    let text = format!(
        "{}: {} steps{} ({steps_per_sec:.2} a second, {:.1} % of it waiting for data) on {} windows, {} parameters\n\
         {}\nnewest checkpoint  {}\nbest (step {})  {}{}",
        dataset.info().speaker,
        outcome.steps,
        if outcome.stopped_early { ", ended early: the score had stopped falling" } else { "" },
        100.0 * outcome.waiting,
        outcome.n_windows,
        outcome.n_parameters,
        metrics(&outcome.validation),
        outcome.newest.display(),
        outcome.best_step,
        outcome.best.display(),
        page.as_ref().map(|page| format!("\ncurves and poses  {}", page.display())).unwrap_or_default(),
    );
    let next = format!("orator generate --checkpoint {} --audio speech.wav --out motion.bvh", outcome.best.display());
    let facts = json!({
        "speaker": dataset.info().speaker,
        "steps": outcome.steps,
        "stopped_early": outcome.stopped_early,
        "steps_per_sec": steps_per_sec,
        "waiting": outcome.waiting,
        "windows": outcome.n_windows,
        "parameters": outcome.n_parameters,
        "validation": outcome.validation,
        "newest": outcome.newest,
        "best": outcome.best,
        "best_step": outcome.best_step,
        "page": page,
    });
    ui.summary(&text, Some(&next), facts);
    Ok(if page.is_some() { Outcome::Done } else { Outcome::SomeFailed })
}

/// The last validation as a table, and the alarm where there is one.
fn metrics(validation: &Validation) -> String {
    let (predicted, still) = (&validation.generator, &validation.mean_pose);
    let row = |name: &str, predicted: f64, still: f64| format!("{name:24}{predicted:9.3}   {still:9.3}\n");
    let distance = |figures: &ValidationMetrics| figures.frechet.unwrap_or(f64::NAN);
    let mut text = format!("on {} {} windows    generator   mean pose\n", validation.n_windows, validation.split);
    text += &row("L1 (normalised)", predicted.l1, still.l1);
    text += &row("PCK 0.2", predicted.pck, still.pck);
    text += &row("PCK 0.2, arms", predicted.pck_body, still.pck_body);
    text += &row("PCK 0.2, fingers", predicted.pck_hands, still.pck_hands);
    text += &row(&format!("Frechet cm2 ({})", validation.n_poses), distance(predicted), distance(still));
    text += &row("motion energy / data's", predicted.energy, still.energy);
    for (channel, of) in &validation.channels {
        text += &row(&format!("{} error (degrees)", channel.name()), of.generator, of.mean_pose);
    }
    text += &format!(
        "bones change by {:.4} mm a frame in the network's own output (the paper's released predictions: 2 to 5 mm)",
        validation.bone_change_mm
    );
    if let Some(alarm) = &validation.alarm {
        text += &format!("\nALARM: {alarm}");
    }
    text
}

/// Writes the page of the training; the training is done, so that what hinders the page is said, and is no error.
pub(super) fn page(
    folder: &Path,
    speaker: &str,
    pairs: impl FnOnce() -> Result<Vec<HeldOutPair>>,
    ui: &Ui,
) -> Option<PathBuf> {
    match pairs().and_then(|pairs| page::write(folder, speaker, &pairs)) {
        Ok(()) => Some(folder.join(page::PAGE)),
        Err(error) => {
            ui.say(&format!("no page of this training: {error:#}"));
            None
        }
    }
}

/// A few intervals that were not trained on; of the training split where there are no others.
pub(super) fn shown(dataset: &Dataset) -> Vec<SampleRef> {
    let splits = [Split::Validation, Split::Train].map(|split| dataset.samples(split));
    let samples = splits.into_iter().find(|samples| !samples.is_empty()).unwrap_or_default();
    let n = samples.len().min(N_PAIRS);
    (0..n).map(|i| samples[i * samples.len() / n].clone()).collect()
}

/// Frames in the middle of so many.
pub(super) fn middle(n_frames: usize, fps: FrameRate) -> Range<usize> {
    let span = ((PAIR_SECS * fps.per_sec()) as usize).min(n_frames);
    let first = (n_frames - span) / 2;
    first..first + span
}

/// True and generated poses of these intervals.
fn pairs(dataset: &Dataset, speaker: &GestureGenerator) -> Result<Vec<HeldOutPair>> {
    let intervals = held_out::read(dataset, &shown(dataset), &speaker.metadata.normalisation)?;
    let pair = |interval: HeldOutInterval| {
        let frames = middle(interval.ground_truth.n_frames(), speaker.fps());
        let HeldOutInterval { key, ground_truth, sound, .. } = interval.cut(frames.clone());
        let (predicted, _) = predictor::motion(speaker, &sound, frames.len())?;
        Ok(HeldOutPair { name: key, start_secs: speaker.fps().secs(frames.start), ground_truth, predicted })
    };
    intervals.into_iter().map(pair).collect()
}

/// The speaker's name: given, or the only one configured.
pub(super) fn speaker(given: Option<&String>, config: &Config) -> Result<String> {
    let names: Vec<&str> = config.settings.speaker.iter().map(|speaker| speaker.name.as_str()).collect();
    match (given, names.as_slice()) {
        (Some(name), _) if names.contains(&name.as_str()) => Ok(name.clone()),
        (Some(name), _) => bail!("no speaker {name:?} in {}; it names {}", config.file.display(), names.join(", ")),
        (None, [only]) => Ok((*only).to_owned()),
        (None, []) => bail!("{} names no speaker; say --dataset and --out", config.file.display()),
        (None, _) => bail!("say which speaker with --speaker: {}", names.join(", ")),
    }
}
