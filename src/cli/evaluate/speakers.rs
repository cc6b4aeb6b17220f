//! `orator evaluate --speaker`: PCK of configured speakers, each with its own dataset and model, in the form of table 1 of
//! Rebol et al. 2021.

use crate::cli::Outcome;
use crate::cli::config_args::ConfigArgs;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, bail, ensure};
use orator_base::stage::artifacts::{StageName, speaker_dir};
use orator_base::stage::progress::Progress as _;
use orator_base::stage::workdir::FolderLock;
use orator_base::text::{counted, length};
use orator_dataset::{Dataset, Split};
use orator_gesture::evaluate::Evaluation;
use orator_gesture::evaluate::baseline::baselines::PredictorKind;
use orator_gesture::evaluate::clips::checkpoint::EvaluatedCheckpoint;
use orator_gesture::evaluate::clips::motion_store::{MEMORY_BYTES, MotionStore};
use orator_gesture::evaluate::table::table::Table;
use orator_gesture::generate::model::model_lock;
use orator_gesture::metrics::definition::Definition;
use orator_gesture::metrics::settings::MetricSettings;
use orator_nn::device::Device;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Value of `--speaker` for all configured speakers.
pub(super) const ALL: &str = "all";

/// Dataset and model of a speaker, `work/dataset/NAME` and `work/gan/NAME`.
pub struct SpeakerFolders {
    pub name: String,
    pub dataset: PathBuf,
    pub model: PathBuf,
}

impl SpeakerFolders {
    /// Folders of a speaker in the work folder.
    pub fn new(work: &Path, name: &str) -> Self {
        let dataset = speaker_dir(work, StageName::Dataset, name);
        Self { name: name.to_owned(), dataset, model: work.join("gan").join(name) }
    }
}

/// Folders of the speakers that `which` selects: a name, or `all`.
///
/// # Errors
/// A configuration that cannot be read or has no such speaker.
pub(super) fn folders(config: &ConfigArgs, which: &str) -> Result<Vec<SpeakerFolders>> {
    let config = config.load()?;
    let (work, names) = (&config.settings.work.dir, config.settings.speaker.iter().map(|speaker| &speaker.name));
    let selected: Vec<&String> = names.clone().filter(|name| which == ALL || *name == which).collect();
    ensure!(
        !selected.is_empty(),
        "no speaker {which:?} in {}: expected {ALL} or one of {}",
        config.file.display(),
        names.map(String::as_str).collect::<Vec<_>>().join(", ")
    );
    Ok(selected.into_iter().map(|name| SpeakerFolders::new(work, name)).collect())
}

/// Measures all `speakers` on `split`; a speaker that cannot be measured does not stop the others.
pub(super) fn run(
    speakers: &[SpeakerFolders],
    split: Split,
    settings: &MetricSettings,
    device: &Device,
    ui: &Ui,
) -> Result<Outcome> {
    let (mut text, mut rows, mut n_failed) = (heading(split, settings), Vec::new(), 0);
    for speaker in speakers {
        match measure(speaker, split, settings, device, ui) {
            Ok((_, table)) => {
                let _ = writeln!(text, "{:<16} {}", speaker.name, line(&table));
                rows.push(row(&speaker.name, &table));
            }
            Err(error) => {
                n_failed += 1;
                ui.say(&format!("failed  {}: {error:#}", speaker.name));
                rows.push(json!({ "speaker": speaker.name, "error": format!("{error:#}") }));
            }
        }
    }
    if n_failed == speakers.len() {
        bail!("no speaker could be measured: {} failed", counted(n_failed, "speaker"));
    }
    let next = speakers.first().map(|speaker| {
        format!("orator evaluate --dataset {} --checkpoint {}", speaker.dataset.display(), speaker.model.display())
    });
    ui.summary(
        &text,
        next.as_deref(),
        json!({ "split": split.name(), "speakers": rows, "failed": n_failed, "next": next }),
    );
    Ok(if n_failed > 0 { Outcome::SomeFailed } else { Outcome::Done })
}

/// Evaluates the model of a speaker on `split` of its dataset.
///
/// # Errors
/// A dataset, split or model that is missing or cannot be measured.
pub fn measure(
    speaker: &SpeakerFolders,
    split: Split,
    settings: &MetricSettings,
    device: &Device,
    ui: &Ui,
) -> Result<(Evaluation, Table)> {
    let _dataset = FolderLock::shared(&speaker.dataset)?;
    let _model = model_lock(&speaker.model)?;
    let dataset = Dataset::open(&speaker.dataset)?;
    let (model, name) = (std::slice::from_ref(&speaker.model), &dataset.info().speaker);
    let checkpoints = EvaluatedCheckpoint::open_all_on(model, name, device)?;
    let store = MotionStore::in_folder(&speaker.dataset, MEMORY_BYTES);
    let evaluation = Evaluation::of_generators(&dataset, &checkpoints, split, &store, ui)?;
    let table = evaluation.measure(settings, ui);
    let table = table.with_context(|| format!("cannot measure the speaker {}", speaker.name))?;
    Ok((evaluation, table))
}

fn heading(split: Split, settings: &MetricSettings) -> String {
    let alphas: Vec<String> = settings.alphas.iter().map(f64::to_string).collect();
    format!(
        "PCK on the {} split, alpha {}; 95 % intervals\n{:<16} {:<30} {:<30} test data\n",
        split.name(),
        alphas.join(" and "),
        "speaker",
        "model",
        "mean pose"
    )
}

/// Indices of the PCK of all joints, one per alpha: in 3D if the convention has it.
fn pck(table: &Table) -> impl Iterator<Item = usize> {
    let all = || table.definitions.iter().filter(|of| of.name.starts_with("pck") && of.part == "all");
    let name = all().map(|of| of.name).find(|name| *name == "pck_3d").or_else(|| Some(all().next()?.name));
    let is_chosen = move |of: &Definition| Some(of.name) == name && of.part == "all";
    table.definitions.iter().enumerate().filter(move |(_, of)| is_chosen(of)).map(|(index, _)| index)
}

/// Values of a predictor in percent with intervals, one per alpha.
fn cell(table: &Table, kind: PredictorKind) -> String {
    let values = pck(table).filter_map(|index| {
        let estimate = table.row(kind)?.values.get(index)?;
        let [low, value, high] =
            [estimate.interval.low, estimate.value, estimate.interval.high].map(|share| 100.0 * share);
        Some(if low.is_finite() { format!("{value:.1} ({low:.1}, {high:.1})") } else { format!("{value:.1}") })
    });
    values.collect::<Vec<_>>().join(" / ")
}

fn line(table: &Table) -> String {
    let data = format!("{}, {}", counted(table.n_clips, "clip"), length(table.secs));
    let [model, mean] = [PredictorKind::Prediction, PredictorKind::MeanPose].map(|kind| cell(table, kind));
    format!("{model:<30} {mean:<30} {data}")
}

fn row(name: &str, table: &Table) -> Value {
    let values = |kind: PredictorKind| -> Vec<Value> {
        pck(table)
            .filter_map(|index| Some((index, table.row(kind)?.values.get(index)?)))
            .map(|(index, estimate)| {
                let alpha = &table.definitions[index].parameters["alpha"];
                json!({ "alpha": alpha, "value": estimate.value, "low": estimate.interval.low, "high": estimate.interval.high })
            })
            .collect()
    };
    json!({
        "speaker": name, "secs": table.secs, "n_clips": table.n_clips, "trained_on": table.trained_on,
        "pck": values(PredictorKind::Prediction), "pck_of_mean_pose": values(PredictorKind::MeanPose),
    })
}

/// Folders whose locks the evaluation takes.
pub(super) fn locked(speakers: &[SpeakerFolders]) -> impl Iterator<Item = &Path> {
    speakers.iter().flat_map(|speaker| [speaker.dataset.as_path(), speaker.model.as_path()])
}
