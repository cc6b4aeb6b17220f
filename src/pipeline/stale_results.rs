//! The trained models of the speakers, and the datasets and models that are stale, with the commands that rebuild them:
//! their joints come from an older lifter, or the dataset of a model has changed. The lift record of each video has the
//! hashes of the weights, and a checkpoint that of its dataset.

use super::status::UnitState;
use anyhow::Result;
use orator_base::stage::artifacts::{self, StageName, speaker_dir};
use orator_base::stage::fingerprint::{HashCache, hash_file};
use orator_base::stage::record::Record;
use orator_base::stage::{Stage, Unit};
use orator_dataset::CHECKSUMS;
use orator_formats::checkpoint;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Settings of the lift stage that state its weights.
const WEIGHTS: [&str; 2] = ["body_weights", "hand_weights"];

/// A dataset or model to rebuild.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct StaleResult {
    /// `dataset SPEAKER` or `model gan/FOLDER`.
    pub name: String,
    /// Why it is to be rebuilt.
    pub reason: String,
    /// Command of `orator` that rebuilds it, without the options of the configuration.
    pub command: String,
}

/// Ending of the folder to which `orator run --train` moves a stale model.
pub const OLD_MODEL: &str = "-old";

/// A trained model, or that of a speaker who has none.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ModelStatus {
    /// `gan/FOLDER` or `seq2seq/FOLDER`.
    pub name: String,
    pub state: UnitState,
    /// Step of the newest checkpoint.
    pub step: Option<usize>,
    /// Why it is not up to date; empty if it is.
    pub reason: String,
}

/// Whether a lifted video was lifted with other weights or by another version of the stage than `lift` would use.
///
/// # Errors
/// Weights that cannot be read.
pub fn has_other_lifter(lift: &dyn Stage, videos: &[Unit], work: &Path, hashes: &HashCache) -> Result<bool> {
    for unit in videos {
        let Some(record) = Record::read(&artifacts::dir(work, StageName::Lift, unit)) else { continue };
        let (was, now) = (record.fingerprint, lift.settings(unit));
        let section = StageName::Lift.as_str();
        let has_changed = |key: &&str| was.settings[section][*key] != now[section][*key];
        if was.version != lift.version() || WEIGHTS.iter().any(has_changed) {
            return Ok(true);
        }
        for input in lift.inputs(unit)?.iter().filter(|input| input.role.ends_with("weights")) {
            if was.inputs.get(&input.role) != Some(&hashes.hash(&input.path)?) {
                return Ok(true);
            }
        }
    }
    Ok(false)
}

/// Datasets and models to rebuild, and all models; `speakers` states for each whether [`has_other_lifter`] holds.
pub fn find(work: &Path, speakers: &BTreeMap<String, bool>) -> (Vec<StaleResult>, Vec<ModelStatus>) {
    let hash = |speaker: &String| hash_file(&speaker_dir(work, StageName::Dataset, speaker).join(CHECKSUMS)).ok();
    let datasets: BTreeMap<&str, (String, bool)> = speakers
        .iter()
        .filter_map(|(speaker, has_other)| Some((speaker.as_str(), (hash(speaker)?, *has_other))))
        .collect();
    let stale = datasets.iter().filter(|(_, (_, has_other))| *has_other).map(|(speaker, _)| StaleResult {
        name: format!("dataset {speaker}"),
        reason: "lifted by an older lifter".to_owned(),
        command: "run".to_owned(),
    });
    let (mut found, mut models): (Vec<StaleResult>, Vec<ModelStatus>) = (stale.collect(), Vec::new());
    let mut trained_speakers = BTreeSet::new();
    for kind in ["gan", "seq2seq"] {
        let entries = std::fs::read_dir(work.join(kind)).into_iter().flatten().flatten();
        let mut folders: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
        folders.sort();
        for folder in folders {
            let Some((speakers, model, command)) = model(kind, &folder, &datasets) else { continue };
            trained_speakers.extend(speakers);
            if model.state == UnitState::Stale {
                let (name, reason) = (format!("model {}", model.name), model.reason.clone());
                found.push(StaleResult { name, reason, command });
            }
            models.push(model);
        }
    }
    let missing = datasets.keys().filter(|speaker| !trained_speakers.contains(**speaker));
    models.extend(missing.map(|speaker| ModelStatus {
        name: format!("gan/{speaker}"),
        state: UnitState::NeverDone,
        step: None,
        reason: "not trained yet".to_owned(),
    }));
    (found, models)
}

/// Status of the model in a folder, with the speakers that it was trained on and the command that trains it anew. It is
/// stale if it was trained on a dataset of an older lifter, or on another version of its dataset.
fn model(
    kind: &str,
    folder: &Path,
    datasets: &BTreeMap<&str, (String, bool)>,
) -> Option<(Vec<String>, ModelStatus, String)> {
    let folder_name = folder.file_name()?.to_string_lossy();
    if folder_name.ends_with(OLD_MODEL) && !datasets.contains_key(&*folder_name) {
        return None;
    }
    let newest = checkpoint::list(folder).ok()?.pop();
    let step = newest.as_ref().map(|(step, _)| *step);
    let best = Some(folder.join("best.safetensors")).filter(|best| best.is_file());
    let facts = checkpoint::facts(&best.or_else(|| Some(newest?.1))?).ok()?;
    let others = facts["other_speakers"].as_array().into_iter().flatten();
    let trained: Vec<(&str, &str)> = std::iter::once(&facts["speaker"])
        .chain(others)
        .filter_map(|speaker| Some((speaker["name"].as_str()?, speaker["dataset"].as_str()?)))
        .collect();
    let reasons = trained.iter().filter_map(|(speaker, hash)| {
        let (present, has_other) = datasets.get(speaker)?;
        match (hash == present, *has_other) {
            (true, true) => Some("trained on a dataset of an older lifter"),
            (true, false) => None,
            (false, _) => (!hash.is_empty()).then_some("trained on another version of its dataset"),
        }
    });
    let reason = reasons.min();
    let known = trained.iter().map(|(speaker, _)| *speaker).filter(|speaker| datasets.contains_key(speaker));
    let speakers: Vec<String> = known.map(str::to_owned).collect();
    speakers.first()?;
    let speaker = if trained.len() > 1 { "all" } else { trained.first()?.0 };
    let out = folder.with_file_name(format!("{folder_name}-new"));
    let command = format!("train {kind} --speaker {speaker} --out {}", out.display());
    let state = if reason.is_some() { UnitState::Stale } else { UnitState::UpToDate };
    let (name, reason) = (format!("{kind}/{folder_name}"), reason.unwrap_or_default().to_owned());
    Some((speakers, ModelStatus { name, state, step, reason }, command))
}
