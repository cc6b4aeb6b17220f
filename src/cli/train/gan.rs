//! `orator train gan`.

use super::training::{ALL, TrainedModel, TrainingFolders, TrainingPage, middle, page_samples, speed, train_all};
use crate::cli::Outcome;
use crate::cli::config_args::{ConfigArgs, DeviceArgs};
use crate::cli::ui::Ui;
use anyhow::Result;
use orator_base::text::counted;
use orator_dataset::Dataset;
use orator_dataset::config::Config;
use orator_formats::word_vectors::WordVectors;
use orator_gesture::evaluate::baseline::predictor;
use orator_gesture::evaluate::clips::held_out;
use orator_gesture::evaluate::clips::held_out::HeldOutInterval;
use orator_gesture::generate::GestureGenerator;
use orator_gesture::generate::model::GenerationChoice;
use orator_gesture::train::epochs::ValidatedStep;
use orator_gesture::train::gan::score::{Validation, ValidationMetrics, below_mean_pose};
use orator_gesture::train::gan::train::{self, TrainingStart};
use orator_nn::device::Device;
use orator_report::training::strip::HeldOutPair;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Train the speech-to-gesture GAN.
///
/// Trains on a dataset of `orator run` or `orator import` with the settings of `[gan]`: one model per speaker
/// (`--all`: for every speaker), or one model of several speakers (`--speaker all`, or several folders after
/// `--dataset`) with a speaker embedding.
///
/// The output folder receives checkpoints, `metrics.jsonl`, TensorBoard events and a page of curves. If it contains
/// checkpoints, training resumes from the newest one with the settings of that checkpoint; the result is
/// byte-identical to that of an uninterrupted training.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    config: ConfigArgs,
    /// Speaker to train, or `all` for one model of all speakers of the configuration; optional if the configuration
    /// names a single speaker.
    #[arg(long, value_name = "NAME")]
    speaker: Option<String>,
    /// Train one model per speaker, one after another. Speakers that another process trains at the moment, on any
    /// machine, are skipped; a failure does not stop the others.
    #[arg(long, conflicts_with_all = ["speaker", "out", "dataset"])]
    all: bool,
    /// Total number of training steps; defaults to `gan.steps` of the configuration.
    #[arg(long, value_name = "N")]
    steps: Option<usize>,
    /// Initialise from the model of another speaker: a checkpoint of `orator train gan`, or its folder. Normalisation
    /// and skeleton are those of the new speaker. Ignored when a training resumes.
    #[arg(long, value_name = "FILE|DIR")]
    from: Option<PathBuf>,
    /// Table of word vectors that initialise the word embeddings of `gan.words`.
    #[arg(long, value_name = "FILE")]
    words: Option<PathBuf>,
    /// Folder of the checkpoints; defaults to gan/SPEAKER in the work folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Dataset folder, or those of several speakers; defaults to dataset/SPEAKER in the work folder.
    #[arg(long, value_name = "DIR", num_args = 1..)]
    dataset: Vec<PathBuf>,
    #[command(flatten)]
    device: DeviceArgs,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let config = if args.dataset.is_empty() { args.config.load()? } else { args.config.load_or_default()? };
    let device = args.device.open(config.settings.work.device, || None, ui)?;
    if args.all {
        let trained = train_all(&config, ui, |speaker| train_one(&args, Some(speaker), &config, &device, ui))?;
        return Ok(trained.report(ui));
    }
    Ok(train_one(&args, args.speaker.as_ref(), &config, &device, ui)?.report(ui))
}

/// Trains the model of a configured speaker on its dataset, in `gan/SPEAKER` of the work folder.
pub fn train_speaker(config: &Config, speaker: &str, device: &Device, ui: &Ui) -> Result<TrainedModel> {
    let none = ConfigArgs { config: config.file.clone(), set: Vec::new() };
    let (from, words, out, dataset, unused) = (None, None, None, Vec::new(), DeviceArgs::default());
    let args = Args { config: none, speaker: None, all: true, steps: None, from, words, out, dataset, device: unused };
    train_one(&args, Some(&speaker.to_owned()), config, device, ui)
}

fn train_one(args: &Args, speaker: Option<&String>, config: &Config, device: &Device, ui: &Ui) -> Result<TrainedModel> {
    let out = &args.out;
    let folders = TrainingFolders { config, speaker, dataset: args.dataset.first(), out: out.as_ref() };
    let is_named = |name: &String| config.settings.speaker.iter().any(|of| of.name == *name);
    let are_all = args.dataset.is_empty() && speaker.is_some_and(|name| name == ALL && !is_named(name));
    let (datasets, out) = if are_all || args.dataset.len() > 1 {
        folders.open_several("gan", &args.dataset)?
    } else {
        let (dataset, out) = folders.open("gan")?;
        (vec![dataset], out)
    };
    let datasets: Vec<&Dataset> = datasets.iter().collect();
    let names: Vec<&str> = datasets.iter().map(|dataset| dataset.info().speaker.as_str()).collect();
    let names = names.join(", ");
    let mut settings = config.settings.gan.clone();
    if let Some(steps) = args.steps {
        settings.steps = steps.into();
    }

    let start = Instant::now();
    let poses = || {
        let mut all = Vec::new();
        for dataset in &datasets {
            let speaker = (datasets.len() > 1).then(|| dataset.info().speaker.clone());
            let choice = GenerationChoice { speaker, seed: None };
            let generator = GestureGenerator::open_as(&out.join(train::BEST), &choice, device)?;
            all.extend(pairs(dataset, &generator, datasets.len())?);
        }
        Ok(all)
    };
    let mut page = TrainingPage::new(&out, names.clone(), Box::new(poses), ui);
    let validated = &mut |at| page.update(at);
    let (from, vectors) = (args.from.as_deref(), args.words.as_deref().map(WordVectors::open).transpose()?);
    let training = TrainingStart { device, from, vectors: vectors.as_ref() };
    let outcome = train::train(&datasets, &settings, &training, &out, ui, validated)?;
    let (speed, steps_per_sec) = speed(outcome.began_at, outcome.steps, start.elapsed().as_secs_f64());
    let page = page.finish(ValidatedStep { step: outcome.steps, best_step: outcome.best_step });
    let text = format!(
        "{}: {}{} ({speed}, {:.1} % of the time waiting for data) on {}, {} parameters\n\
         {}\nnewest checkpoint  {}\nbest (step {}{})  {}{}",
        names,
        counted(outcome.steps, "step"),
        if outcome.stopped_early { ", stopped early: the validation score no longer improved" } else { "" },
        100.0 * outcome.waiting,
        counted(outcome.n_examples, "window"),
        outcome.n_parameters,
        metrics(&outcome.validation),
        outcome.newest.display(),
        outcome.best_step,
        // Step 0 is evaluated only if the training was initialised from a model.
        if outcome.best_step == 0 { ", the initial model: training did not improve it" } else { "" },
        outcome.best.display(),
        page.as_ref().map(|page| format!("\ncurves and poses  {}", page.display())).unwrap_or_default(),
    );
    let best = outcome.best.display();
    let spoken = if datasets.len() > 1 { format!(" --speaker {}", datasets[0].info().speaker) } else { String::new() };
    let next = format!("orator generate --checkpoint {best}{spoken} --audio speech.wav --out motion.bvh");
    let facts = json!({
        "speaker": names,
        "steps": outcome.steps,
        "stopped_early": outcome.stopped_early,
        "steps_per_sec": steps_per_sec,
        "waiting": outcome.waiting,
        "windows": outcome.n_examples,
        "parameters": outcome.n_parameters,
        "validation": outcome.validation,
        "newest": outcome.newest,
        "best": outcome.best,
        "best_step": outcome.best_step,
        "page": page,
        "next": next,
    });
    Ok(TrainedModel { text, next, facts, has_page: page.is_some() })
}

/// The last validation as a table, with applicable warnings.
fn metrics(validation: &Validation) -> String {
    let (predicted, mean_pose) = (&validation.generator, &validation.mean_pose);
    let row = |name: &str, predicted: f64, mean_pose: f64| format!("{name:28}{predicted:9.3}   {mean_pose:9.3}\n");
    let distance = |metrics: &ValidationMetrics| metrics.frechet.unwrap_or(f64::NAN);
    let windows = format!("on {}", counted(validation.n_windows, &format!("{} window", validation.split)));
    let mut text = format!("{windows:28}generator   mean pose\n");
    text += &row("L1 (normalised)", predicted.l1, mean_pose.l1);
    text += &row("PCK 0.2", predicted.pck, mean_pose.pck);
    text += &row("PCK 0.2, arms", predicted.pck_body, mean_pose.pck_body);
    text += &row("PCK 0.2, fingers", predicted.pck_hands, mean_pose.pck_hands);
    text +=
        &row(&format!("Frechet, cm\u{b2} ({} poses)", validation.n_poses), distance(predicted), distance(mean_pose));
    text += &row("motion energy / truth", predicted.energy, mean_pose.energy);
    for (channel, of) in &validation.channels {
        text += &row(&format!("{} error (degrees)", channel.name()), of.generator, of.mean_pose);
    }
    text += &format!(
        "bone lengths change by {:.4} mm per frame in the network output (predictions published in 2021: 2 to 5 mm)",
        validation.bone_change_mm
    );
    if let Some(below) = below_mean_pose([predicted.l1, mean_pose.l1], Some([predicted.pck, mean_pose.pck])) {
        text += &format!("\n{below}");
    }
    if let Some(alarm) = &validation.alarm {
        text += &format!("\nwarning: {alarm}");
    }
    text
}

/// True and generated poses of a few intervals; `n_speakers` speakers share the page.
fn pairs(dataset: &Dataset, speaker: &GestureGenerator, n_speakers: usize) -> Result<Vec<HeldOutPair>> {
    let mut samples = page_samples(dataset);
    samples.truncate(samples.len().div_ceil(n_speakers));
    let split = samples.first().map_or("", |sample| sample.split.name());
    let intervals = held_out::read(dataset, &samples, &speaker.metadata.normalisation)?;
    let pair = |interval: HeldOutInterval| {
        let frames = middle(interval.ground_truth.n_frames(), speaker.fps());
        let HeldOutInterval { key, ground_truth, sound, words, .. } = interval.cut(frames.clone());
        let (predicted, _) = predictor::motion(speaker, &sound, &words, frames.len())?;
        let (name, start_secs) = (format!("{split} {key}"), speaker.fps().secs(frames.start));
        Ok(HeldOutPair { name, start_secs, ground_truth, predicted })
    };
    intervals.into_iter().map(pair).collect()
}
