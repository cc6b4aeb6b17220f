//! Trainings below a work folder: their state, curves and alarms from `metrics.jsonl`.

use anyhow::{Result, ensure};
use orator_base::stage::artifacts::StageName;
use orator_formats::checkpoint;
use orator_gesture::generate::model::{BEST, checkpoint_file};
use orator_gesture::train::log;
use serde_json::{Value, json};
use std::fs::File;
use std::path::{Path, PathBuf};

/// Folders of the two kinds of trainings in the work folder.
const KINDS: [&str; 2] = ["gan", "seq2seq"];

/// Names such as `gan/host` of the folders below `work` that contain a log of a training, sorted.
fn names(work: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for kind in KINDS {
        for entry in std::fs::read_dir(work.join(kind)).into_iter().flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if !name.starts_with('.') && entry.path().join(log::FILE).is_file() {
                names.push(format!("{kind}/{name}"));
            }
        }
    }
    names.sort();
    names
}

/// Folder of the training `name`.
///
/// # Errors
/// There is no such training.
pub fn folder(work: &Path, name: &str) -> Result<PathBuf> {
    ensure!(names(work).iter().any(|known| known == name), "there is no training {name:?}");
    Ok(work.join(name))
}

/// All trainings with their state.
///
/// # Errors
/// An unreadable log.
pub fn trainings(work: &Path) -> Result<Value> {
    let rows: Result<Vec<Value>> = names(work).iter().map(|name| state(&work.join(name), name)).collect();
    Ok(json!({ "trainings": rows? }))
}

fn state(folder: &Path, name: &str) -> Result<Value> {
    let lines = log::read(folder)?;
    let score = |line: &Value| line["validation"]["score"].as_f64();
    let best = lines.iter().filter(|line| score(line).is_some());
    let best = best.min_by(|a, b| score(a).unwrap_or(f64::MAX).total_cmp(&score(b).unwrap_or(f64::MAX)));
    let newest = checkpoint_file(folder).ok().and_then(|file| checkpoint::facts(&file).ok());
    Ok(json!({
        "name": name,
        "state": if is_running(folder) { "running" } else { "ended" },
        "step": lines.last().map_or(&Value::Null, |line| &line["step"]),
        "steps": newest.as_ref().map_or(&Value::Null, |facts| &facts["settings"]["steps"]),
        "best_step": best.map_or(&Value::Null, |line| &line["step"]),
        "best_score": best.and_then(score),
        "alarms": alarms(&lines),
    }))
}

/// Whether a training writes into the folder: it holds the lock of the folder.
fn is_running(folder: &Path) -> bool {
    File::open(folder.join(".lock")).is_ok_and(|file| file.try_lock_shared().is_err())
}

/// Alarms of the last validation.
fn alarms(lines: &[Value]) -> Vec<&str> {
    let last = lines.iter().rev().find(|line| line["validation"].is_object());
    last.and_then(|line| line["validation"]["alarm"].as_str()).into_iter().collect()
}

/// Curves of a training after step `after`; `None`: from the start.
///
/// # Errors
/// There is no such training, or its log cannot be read.
pub fn curves(work: &Path, name: &str, after: Option<u64>) -> Result<Value> {
    let lines = log::read(&folder(work, name)?)?;
    let (mut train, mut validations) = (Vec::new(), Vec::new());
    for line in lines.iter().filter(|line| line["step"].as_u64() > after) {
        let validation = &line["validation"];
        if validation.is_object() {
            // Sequence-to-sequence networks have their values at the top level.
            let own = if validation["generator"].is_object() { &validation["generator"] } else { validation };
            let mean_pose = &validation["mean_pose"]["l1"];
            let mean_pose = if mean_pose.is_null() { &validation["mean_pose_l1"] } else { mean_pose };
            validations.push(json!({
                "step": line["step"], "l1": own["l1"], "mean_pose_l1": mean_pose, "pck": own["pck"], "frechet": own["frechet"], "energy": own["energy"], "score": validation["score"],
            }));
        } else {
            train.push(json!({
                "step": line["step"], "l1": line["l1"], "adversarial": line["adversarial"],
                "discriminator": line["discriminator"],
            }));
        }
    }
    Ok(json!({ "train": train, "validations": validations, "alarms": alarms(&lines) }))
}

/// Trainings with a readable checkpoint, and the speakers of a model of several.
pub fn checkpoints(work: &Path) -> Value {
    let row = |name: String| {
        let facts = checkpoint::facts(&checkpoint_file(&work.join(&name)).ok()?).ok()?;
        Some(json!({ "name": name, "step": facts["step"], "speakers": speakers(&facts) }))
    };
    json!({ "checkpoints": names(work).into_iter().filter_map(row).collect::<Vec<_>>() })
}

/// Newest checkpoint of a training: the last `step-*.safetensors`, else the best.
///
/// # Errors
/// There is no such training or no checkpoint.
pub fn newest_checkpoint(work: &Path, name: &str) -> Result<PathBuf> {
    let folder = folder(work, name)?;
    let last = checkpoint::list(&folder)?.pop().map(|(_, file)| file);
    let newest = last.unwrap_or_else(|| folder.join(BEST));
    ensure!(newest.is_file(), "{name} has no checkpoint yet");
    Ok(newest)
}

/// Names of the speakers of a model of several; empty for a model of one.
fn speakers(facts: &Value) -> Vec<&str> {
    let others: Vec<&Value> = facts["other_speakers"].as_array().into_iter().flatten().collect();
    let all = std::iter::once(&facts["speaker"]).chain(others.iter().copied());
    if others.is_empty() { Vec::new() } else { all.filter_map(|speaker| speaker["name"].as_str()).collect() }
}

/// First speaker of a model of several, `None` for a model of one, and the dataset of the speaker.
///
/// # Errors
/// The checkpoint cannot be read, or the dataset does not exist.
pub fn dataset(work: &Path, name: &str, checkpoint: &Path) -> Result<(Option<String>, PathBuf)> {
    let facts = checkpoint::facts(checkpoint)?;
    let chosen = speakers(&facts).first().map(|speaker| (*speaker).to_owned());
    let speaker = chosen.as_deref().unwrap_or_else(|| name.rsplit('/').next().unwrap_or(name));
    let dataset = work.join(StageName::Dataset.as_str()).join(speaker);
    ensure!(dataset.is_dir(), "the dataset of {name} does not exist: expected {}", dataset.display());
    Ok((chosen, dataset))
}
