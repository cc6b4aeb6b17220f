//! `orator train seq2seq`.

use super::training::{TrainedModel, TrainingFolders, TrainingPage, middle, page_samples, speed, train_all};
use crate::cli::Outcome;
use crate::cli::config_args::{ConfigArgs, DeviceArgs};
use crate::cli::setup::words;
use crate::cli::ui::Ui;
use anyhow::Result;
use ndarray::s;
use orator_base::stage::progress::Progress as _;
use orator_base::text::counted;
use orator_base::types::pose3d::Motion;
use orator_dataset::Dataset;
use orator_dataset::config::{Auto, Config};
use orator_formats::bvh::exponential_maps::JointMapping;
use orator_formats::word_vectors::WordVectors;
use orator_gesture::evaluate::clips::held_out;
use orator_gesture::evaluate::clips::held_out::HeldOutInterval;
use orator_gesture::generate::seq2seq::SequenceGenerator;
use orator_gesture::generate::seq2seq::architecture::word_encoder;
use orator_gesture::generate::seq2seq::poses::PoseFormat;
use orator_gesture::train::epochs::ValidatedStep;
use orator_gesture::train::gan::score::below_mean_pose;
use orator_gesture::train::seq2seq::captures::CaptureFolder;
use orator_gesture::train::seq2seq::source::TrainingSource;
use orator_gesture::train::seq2seq::train;
use orator_nn::device::Device;
use orator_nn::seq2seq::config::CPU_ONLY;
use orator_report::training::strip::HeldOutPair;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Train the sequence-to-sequence network of FineMotion's GENEA 2020 entry.
///
/// Trains on a dataset of `orator run` or `orator import`, or on a folder of captures (`NAME.bvh` with `NAME.wav` and
/// optionally a transcript of that name), with the settings of `[seq2seq]`.
///
/// The output folder receives checkpoints, `metrics.jsonl`, TensorBoard events and a page of curves. If it contains
/// checkpoints, training resumes from the newest one; the result is byte-identical to that of an uninterrupted
/// training.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    config: ConfigArgs,
    /// Speaker to train; optional if the configuration names a single speaker.
    #[arg(long, value_name = "NAME", conflicts_with = "captures")]
    speaker: Option<String>,
    /// Train one model per speaker, one after another. Speakers that another process trains at the moment, on any
    /// machine, are skipped; a failure does not stop the others.
    #[arg(long, conflicts_with_all = ["speaker", "out", "dataset", "captures"])]
    all: bool,
    /// Dataset folder; defaults to dataset/SPEAKER in the work folder.
    #[arg(long, value_name = "DIR", conflicts_with = "captures")]
    dataset: Option<PathBuf>,
    /// Folder of captures to train on, instead of a dataset.
    #[arg(long, value_name = "DIR", requires = "out")]
    captures: Option<PathBuf>,
    /// Capture to use for validation, a file name without extension; may be repeated.
    #[arg(long, value_name = "NAME", requires = "captures")]
    hold_out: Vec<String>,
    /// Name of a joint in the captures, such as `Spine3=Chest`, or `Spine3=` if they do not have it; may be repeated.
    #[arg(long, value_name = "JOINT=NAME", requires = "captures")]
    joint: Vec<String>,
    /// Table of word vectors that initialise the word embeddings.
    #[arg(long, value_name = "FILE")]
    words: Option<PathBuf>,
    /// Total number of training steps; defaults to those of `seq2seq.epochs`.
    #[arg(long, value_name = "N")]
    steps: Option<usize>,
    /// Folder of the checkpoints; defaults to seq2seq/SPEAKER in the work folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArgs,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let is_named = args.dataset.is_some() || args.captures.is_some();
    let config = if is_named { args.config.load_or_default()? } else { args.config.load()? };
    let device = args.device.open(config.settings.work.device, || CPU_ONLY, ui)?;
    let vectors = args.words.as_deref().map(WordVectors::open).transpose()?;
    let train = |speaker: Option<&String>| train_one(&args, speaker, &config, vectors.as_ref(), &device, ui);
    if args.all {
        return Ok(train_all(&config, ui, |speaker| train(Some(speaker)))?.report(ui));
    }
    Ok(train(args.speaker.as_ref())?.report(ui))
}

fn train_one(
    args: &Args,
    speaker: Option<&String>,
    config: &Config,
    vectors: Option<&WordVectors>,
    device: &Device,
    ui: &Ui,
) -> Result<TrainedModel> {
    let mut settings = config.settings.seq2seq.clone();
    if let Some(steps) = args.steps {
        (settings.steps, settings.epochs) = (steps.into(), Auto::Chosen);
    }
    let start = Instant::now();
    let train = |source: TrainingSource, out: &Path, poses| {
        if vectors.is_none() && word_encoder(settings.network).is_some() {
            unused_words(&config.settings.models.dir, &source).iter().for_each(|note| ui.say(note));
        }
        let mut page = TrainingPage::new(out, source.name(), poses, ui);
        let validated = &mut |at| page.update(at);
        let outcome = train::train(source, vectors, &settings, device, out, ui, validated)?;
        let page = page.finish(ValidatedStep { step: outcome.steps, best_step: outcome.best_step });
        anyhow::Ok((outcome, page))
    };
    let (outcome, page) = match (&args.captures, &args.out) {
        (Some(folder), Some(out)) => {
            let captures = CaptureFolder::open(folder, &args.hold_out, JointMapping::parse(&args.joint)?)?;
            train(TrainingSource::Captures(&captures), out, Box::new(|| Ok(Vec::new())))?
        }
        _ => {
            let (dataset, out) = (args.dataset.as_ref(), args.out.as_ref());
            let (dataset, out) = TrainingFolders { config, speaker, dataset, out }.open("seq2seq")?;
            let poses = || pairs(&dataset, &SequenceGenerator::open_on(&out.join(train::BEST), device)?);
            train(TrainingSource::Dataset(&dataset), &out, Box::new(poses))?
        }
    };
    let (speed, steps_per_sec) = speed(outcome.began_at, outcome.steps, start.elapsed().as_secs_f64());
    let validation = &outcome.validation;
    let name = speaker.map_or_else(String::new, |name| format!("{name}: "));
    let mut text = format!(
        "{name}{}{} ({speed}) on {}, {}, {} parameters\n\
         on {}: L1 {:.3} (mean pose {:.3}), motion energy / truth {:.2}\n\
         newest checkpoint  {}\nbest (step {})  {}{}",
        counted(outcome.steps, "step"),
        if outcome.stopped_early { ", stopped early: the validation score no longer improved" } else { "" },
        counted(outcome.n_examples, "training segment"),
        counted(outcome.n_words, "word"),
        outcome.n_parameters,
        counted(validation.n_segments, &format!("{} segment", validation.split)),
        validation.l1,
        validation.mean_pose_l1,
        validation.energy,
        outcome.newest.display(),
        outcome.best_step,
        outcome.best.display(),
        page.as_ref().map(|page| format!("\ncurves and poses  {}", page.display())).unwrap_or_default(),
    );
    if let Some(below) = below_mean_pose([validation.l1, validation.mean_pose_l1], None) {
        text += &format!("\n{below}");
    }
    if let Some(alarm) = &validation.alarm {
        text += &format!("\nwarning: {alarm}");
    }
    let next = format!("orator generate --checkpoint {} --audio speech.wav --out motion.bvh", outcome.best.display());
    let facts = json!({
        "speaker": speaker,
        "steps": outcome.steps,
        "stopped_early": outcome.stopped_early,
        "steps_per_sec": steps_per_sec,
        "segments": outcome.n_examples,
        "words": outcome.n_words,
        "parameters": outcome.n_parameters,
        "validation": validation,
        "newest": outcome.newest,
        "best": outcome.best,
        "best_step": outcome.best_step,
        "page": page,
        "next": next,
    });
    Ok(TrainedModel { text, next, facts, has_page: page.is_some() })
}

/// Note on word vectors that are installed in `models` but not used; `None` if none are installed.
fn unused_words(models: &Path, source: &TrainingSource) -> Option<String> {
    let table = words::table_files(models).into_iter().next()?;
    let has_transcripts = match source {
        TrainingSource::Dataset(dataset) => dataset.stats().footage.words.is_some(),
        TrainingSource::Captures(_) => true,
    };
    Some(if has_transcripts {
        format!("the installed word vectors are not used: add --words {}", table.display())
    } else {
        "the installed word vectors are not used: the dataset has no transcripts (`transcripts` under [[speaker]])"
            .into()
    })
}

/// True and generated poses of a few intervals, from the middle of each.
fn pairs(dataset: &Dataset, speaker: &SequenceGenerator) -> Result<Vec<HeldOutPair>> {
    let PoseFormat::Joints { normalisation, .. } = &speaker.metadata.poses else { return Ok(Vec::new()) };
    let (fps, samples) = (speaker.fps(), page_samples(dataset));
    let split = samples.first().map_or("", |sample| sample.split.name());
    let pair = |interval: HeldOutInterval| {
        let predicted = speaker.motion(&speaker.poses(&interval.sound, &interval.words)?)?;
        let frames = middle(interval.ground_truth.n_frames().min(predicted.n_frames()), fps);
        let predicted = Motion::from_joints(fps, predicted.joints.slice(s![frames.clone(), .., ..]).to_owned());
        let start_secs = fps.secs(frames.start);
        let HeldOutInterval { key, ground_truth, .. } = interval.cut(frames);
        Ok(HeldOutPair { name: format!("{split} {key}"), start_secs, ground_truth, predicted })
    };
    held_out::read(dataset, &samples, normalisation)?.into_iter().map(pair).collect()
}
