//! Datasets and trained models whose joints come from an older lifter, with the commands that rebuild them. The lift
//! record of each video has the hashes of the weights, and a checkpoint that of its dataset.

use anyhow::Result;
use orator_base::stage::artifacts::{self, StageName, speaker_dir};
use orator_base::stage::fingerprint::{HashCache, hash_file};
use orator_base::stage::record::Record;
use orator_base::stage::{Stage, Unit};
use orator_dataset::CHECKSUMS;
use orator_formats::checkpoint;
use serde::Serialize;
use std::collections::BTreeMap;
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

/// Datasets and models to rebuild; `speakers` states for each speaker whether [`has_other_lifter`] holds.
pub fn find(work: &Path, speakers: &BTreeMap<String, bool>) -> Vec<StaleResult> {
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
    let mut found: Vec<StaleResult> = stale.collect();
    for kind in ["gan", "seq2seq"] {
        let entries = std::fs::read_dir(work.join(kind)).into_iter().flatten().flatten();
        let mut folders: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
        folders.sort();
        found.extend(folders.iter().filter_map(|folder| stale_model(kind, folder, &datasets)));
    }
    found
}

/// The model in a folder if it was trained on a dataset of an older lifter, or on another version of its dataset.
fn stale_model(kind: &str, folder: &Path, datasets: &BTreeMap<&str, (String, bool)>) -> Option<StaleResult> {
    let newest = || Some(checkpoint::list(folder).ok()?.pop()?.1);
    let file = Some(folder.join("best.safetensors")).filter(|best| best.is_file()).or_else(newest)?;
    let facts = checkpoint::facts(&file).ok()?;
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
    let reason = reasons.min()?.to_owned();
    let speaker = if trained.len() > 1 { "all" } else { trained.first()?.0 };
    let name = folder.file_name()?.to_string_lossy();
    let out = folder.with_file_name(format!("{name}-new"));
    let command = format!("train {kind} --speaker {speaker} --out {}", out.display());
    Some(StaleResult { name: format!("model {kind}/{name}"), reason, command })
}
