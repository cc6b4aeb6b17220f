//! `orator doctor`.

use super::words;
use crate::cli::Outcome;
use crate::cli::config_args::ConfigArgs;
use crate::cli::dataset::align::default_python;
use crate::cli::sandbox::this_program;
use crate::cli::ui::Ui;
use anyhow::Result;
use orator_base::stage::workdir;
use orator_dataset::config::{Config, Settings};
use orator_formats::word_vectors::WordVectors;
use orator_media::aligner::Aligner;
use orator_nn::device;
use orator_onnx::{ModelStore, Runtime};
use orator_pipeline::pose2d::models;
use orator_pipeline::process::probe;
use orator_pipeline::speech::speech_rule::SpeechDetector;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Check the installation and print the commands that fix it.
///
/// Checks the libraries, the ONNX models that the configuration selects, and the work folder. Without a configuration
/// file the defaults are checked.
///
/// Exit code 1: something is missing.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    config: ConfigArgs,
}

/// Result of one check: what was found, or what is missing and the command that fixes it.
struct Check {
    name: String,
    found: Result<String, (String, String)>,
    /// Whether the check found everything that can be installed.
    is_full: bool,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let config =
        if args.config.config.exists() || !args.config.set.is_empty() { args.config.load() } else { defaults() };
    let mut checks = vec![
        ok("ffmpeg libraries", orator_media::ffmpeg::version()),
        ok("OpenCV", orator_media::opencv::version()),
        ok("processor cores", std::thread::available_parallelism().map_or(1, |n| n.get()).to_string()),
    ];
    #[cfg(feature = "cuda")]
    checks.extend(gpus());
    match config {
        Ok(config) => {
            checks.push(ok("configuration", config.file.display().to_string()));
            checks.extend(model_checks(&config.settings));
            checks.extend(word_checks(&config.settings.models.dir));
            checks.extend(recogniser(&config.settings));
            checks.push(work(&config.settings.work.dir));
            checks.push(training_device(&config.settings));
            checks.push(sandbox(config.settings.work.sandbox));
            checks.push(aligner());
        }
        Err(error) => {
            checks.push(missing(
                "configuration",
                format!("{error:#}"),
                "correct it, or create a new one with `orator init DIR`",
            ));
        }
    }
    let lines: Vec<String> = checks.iter().map(Check::line).collect();
    let failed: Vec<&Check> = checks.iter().filter(|check| check.found.is_err()).collect();
    let facts: Vec<_> = checks.iter().map(Check::json).collect();
    let next = match failed.first().map(|check| &check.found) {
        Some(Err((_, fix))) => fix.clone(),
        _ => format!("orator run{}", args.config.flags()),
    };
    ui.summary(&lines.join("\n"), Some(&next), json!({ "checks": facts, "missing": failed.len(), "next": next }));
    Ok(if failed.is_empty() { Outcome::Done } else { Outcome::CheckFailed })
}

fn defaults() -> Result<Config> {
    let here = std::env::current_dir()?;
    let mut settings = Settings::default();
    settings.work.dir = here.join(&settings.work.dir);
    settings.models.dir = here.join(&settings.models.dir);
    Ok(Config { settings, file: here.join("pipeline.toml (not found: defaults)"), notes: Vec::new() })
}

fn ok(name: &str, found: String) -> Check {
    Check { name: name.to_owned(), found: Ok(found), is_full: true }
}

fn missing(name: &str, problem: String, fix: &str) -> Check {
    Check { name: name.to_owned(), found: Err((problem, fix.to_owned())), is_full: false }
}

/// NVIDIA GPUs, and the libraries of CUDA. They are optional, so nothing counts as missing without them.
#[cfg(feature = "cuda")]
fn gpus() -> Vec<Check> {
    let note = |name: &str, problem: String| Check { is_full: false, ..ok(name, problem) };
    let gpus = match orator_nn::cuda::gpu::list() {
        Ok(gpus) => gpus.into_iter().enumerate().map(|(number, gpu)| ok(&format!("GPU {number}"), gpu)).collect(),
        Err(error) => vec![note("GPU", format!("none: {error:#}"))],
    };
    let libraries = orator_nn::cuda::libraries::status().iter().map(|(name, found)| match found {
        Ok(path) => ok(name, path.display().to_string()),
        Err(problem) => note(name, problem.clone()),
    });
    gpus.into_iter().chain(libraries).collect()
}

/// Restrictions of processes that read videos on this machine. They are optional, so nothing counts as missing without
/// them.
fn sandbox(is_enabled: bool) -> Check {
    let (is_active, found) = match probe(&this_program()) {
        _ if !is_enabled => (false, "not active: work.sandbox = false".to_owned()),
        Ok(restriction) => (restriction.is_active(), restriction.to_string()),
        Err(error) => (false, format!("not active: {error:#}")),
    };
    Check { is_full: is_active, ..ok("sandbox", found) }
}

/// The device of trainings.
fn training_device(settings: &Settings) -> Check {
    let choice = settings.work.device;
    match device::open(choice, || None) {
        Ok((_, chosen)) => ok("device of trainings", chosen.unwrap_or_else(|| choice.to_string())),
        Err(error) => missing("device of trainings", error.to_string(), "set work.device = \"auto\""),
    }
}

/// The word aligner. Only `orator align` needs it, so nothing counts as missing without it.
fn aligner() -> Check {
    let python = default_python();
    match Aligner::version(&python) {
        Ok(version) => ok("word aligner (English)", format!("pocketsphinx {version} ({})", python.display())),
        Err(error) => {
            let found = format!("needed by `orator align` only: {error:#}");
            Check { is_full: false, ..ok("word aligner (English)", found) }
        }
    }
}

/// ONNX Runtime, and the models that the configuration selects.
fn model_checks(settings: &Settings) -> Vec<Check> {
    let dir = &settings.models.dir;
    let runtime = match Runtime::load(&settings.models.onnxruntime, dir) {
        Ok(runtime) => runtime,
        Err(error) => return vec![missing("ONNX Runtime", format!("{error:#}"), "orator models fetch")],
    };
    let mut checks = vec![ok("ONNX Runtime", format!("{} ({})", runtime.version(), runtime.library().display()))];
    let selected = ModelStore::open(dir).and_then(|store| Ok((models::choose(&settings.pose2d, &store)?, store)));
    let (pose2d, store) = match selected {
        Ok(selected) => selected,
        Err(error) => {
            checks.push(missing(
                "model manifest",
                format!("{error:#}"),
                "correct it, or remove it to use the built-in manifest",
            ));
            return checks;
        }
    };
    checks.push(match models::runtime(&settings.models) {
        Ok((_, note)) => ok("image models", note.unwrap_or_else(|| settings.models.provider.to_string())),
        Err(error) => missing("image models", format!("{error:#}"), "set models.provider = \"cpu\""),
    });
    for (_, _, id) in models::keys(&pose2d).into_iter().filter(|(_, _, id)| !id.is_empty()) {
        let opened = store.manifest().get(id).and_then(|entry| Ok(store.check(&runtime, entry)?));
        checks.push(match opened {
            Ok(model) => ok(&format!("model {id}"), dir.join(&model.entry().file).display().to_string()),
            Err(error) => missing(&format!("model {id}"), format!("{error:#}"), "orator models fetch"),
        });
    }
    if let Some(advice) = models::advice(&settings.pose2d, &store) {
        checks.push(missing("face model", advice.to_owned(), "orator models fetch"));
    }
    match SpeechDetector::advice(settings) {
        Ok(None) => {}
        Ok(Some(advice)) => checks.push(missing("speech model", advice.to_owned(), "orator models fetch")),
        Err(error) => checks.push(missing("speech model", format!("{error:#}"), "orator models fetch")),
    }
    checks
}

/// The speech recogniser. Only `orator transcribe` needs it, so nothing counts as missing without it.
fn recogniser(settings: &Settings) -> Option<Check> {
    let store = ModelStore::open(&settings.models.dir).ok()?;
    Some(match store.recogniser(settings.transcribe.model_id()) {
        Ok(folder) => ok("speech recogniser", folder.display().to_string()),
        Err(error) => Check { is_full: false, ..ok("speech recogniser", format!("none: {error:#}")) },
    })
}

/// Tables of word vectors. Without a table, word embeddings are initialised randomly, so nothing counts as missing.
fn word_checks(models: &Path) -> Vec<Check> {
    let tables = words::opened(models);
    if tables.is_empty() {
        let none = "none (needed by networks that use words only); download them with `orator words fetch`".to_owned();
        return vec![Check { is_full: false, ..ok("word vectors", none) }];
    }
    let check = |(path, table): (PathBuf, Result<WordVectors>)| match table {
        Ok(table) => {
            let (n_words, dim) = (table.n_words(), table.dim());
            ok("word vectors", format!("{n_words} words, {dim} dimensions ({})", path.display()))
        }
        Err(error) => {
            let fix = "remove it, then run `orator words fetch` or `orator words add FILE`";
            missing("word vectors", format!("{error:#}"), fix)
        }
    };
    tables.into_iter().map(check).collect()
}

/// The work folder: whether it is writable and supports locks.
fn work(dir: &Path) -> Check {
    let existing = dir.ancestors().find(|folder| folder.exists()).unwrap_or(dir);
    match workdir::locks_work(existing) {
        Ok(true) => ok("work folder", dir.display().to_string()),
        Ok(false) => ok("work folder", format!("{} (no file locks there: run one command at a time)", dir.display())),
        Err(error) => missing("work folder", format!("{error:#}"), "choose another with --set work.dir=FOLDER"),
    }
}

impl Check {
    fn line(&self) -> String {
        match &self.found {
            Ok(found) => format!("{}     {:26} {found}", if self.is_full { "ok  " } else { "note" }, self.name),
            Err((problem, fix)) => format!("missing  {:26} {problem}\n         {:26} fix: {fix}", self.name, ""),
        }
    }

    fn json(&self) -> serde_json::Value {
        match &self.found {
            Ok(found) => json!({ "name": self.name, "ok": true, "found": found }),
            Err((problem, fix)) => json!({ "name": self.name, "ok": false, "problem": problem, "fix": fix }),
        }
    }
}
