//! `orator models`: which ONNX models there are, getting them, registering others, checking them. Every file is pinned
//! by its SHA-256; what serves other bytes is refused.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, bail, ensure};
use orator::config;
use orator::config::Settings;
use orator::external::onnx::{MANIFEST_FILE, Manifest, Model, ModelEntry, Origin, Runtime, sha256_of};
use orator::stage::progress::Progress;
use orator::stage::workdir;
use serde_json::json;
use std::path::{Path, PathBuf};

/// No model is larger than this.
const MAX_BYTES: u64 = 1 << 30;

/// List, fetch, add and check the ONNX models.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    verb: Verb,
    /// The folder of the models, instead of the configuration's.
    #[arg(long, global = true, value_name = "DIR")]
    models_dir: Option<PathBuf>,
    /// The configuration file; without one the defaults count.
    #[arg(short, long, global = true, default_value = "pipeline.toml", value_name = "FILE")]
    config: PathBuf,
    /// Change one key of the configuration, for instance `--set models.dir=../models`; may be given several times.
    #[arg(long = "set", global = true, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

#[derive(clap::Subcommand)]
enum Verb {
    /// Show every model: what it is for, where it comes from, its licence, and whether it is there.
    List,
    /// Get the models that are missing: from their address where one serves exactly the pinned bytes, else from a
    /// folder that has them. Exit code 2 says that some could not be had.
    Fetch {
        /// Ids; none: the models the configuration chooses.
        ids: Vec<String>,
        /// Every model known.
        #[arg(long, conflicts_with = "ids")]
        all: bool,
        /// A folder with the files, under any name.
        #[arg(long, value_name = "DIR")]
        mirror: Option<PathBuf>,
    },
    /// Register an ONNX file that is fed and read like a known model or layout.
    Add {
        /// The ONNX file; it is copied into the folder of the models.
        file: PathBuf,
        /// Id of the model or layout it is like.
        #[arg(long, value_name = "ID")]
        like: String,
        /// Its own id; none: its file name.
        #[arg(long, value_name = "ID")]
        id: Option<String>,
        /// The terms it may be used under, for the record.
        #[arg(long, default_value = "not stated", value_name = "TEXT")]
        licence: String,
    },
    /// Open every model that is there: right bytes, right names and shapes. Exit code 2 says that some are not right
    /// or that one the configuration chooses is missing.
    Check {
        /// Ids; none: all.
        ids: Vec<String>,
    },
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let Settings { models, pose2d, .. } = settings(&args)?;
    let dir = std::path::absolute(&models.dir)?;
    let manifest = Manifest::load(&dir)?;
    let chosen = [&pose2d.person, &pose2d.body, &pose2d.hand, &pose2d.palm].map(String::as_str);
    match &args.verb {
        Verb::List => list(&manifest, &chosen, &dir, ui),
        Verb::Fetch { ids, all, mirror } => {
            let entries = named(&manifest, ids)?;
            let wanted = |entry: &&ModelEntry| *all || !ids.is_empty() || chosen.contains(&entry.id.as_str());
            fetch(&entries.into_iter().filter(wanted).collect::<Vec<_>>(), &dir, mirror.as_deref(), ui)
        }
        Verb::Add { file, like, id, licence } => {
            let runtime = Runtime::load(&models.onnxruntime, &dir)?;
            let entry = described(file, manifest.like(like)?, id.as_deref(), licence)?;
            add(&runtime, file, &entry, &dir, ui)
        }
        Verb::Check { ids } => {
            let runtime = Runtime::load(&models.onnxruntime, &dir)?;
            let required = |entry: &ModelEntry| !ids.is_empty() || chosen.contains(&entry.id.as_str());
            check(&runtime, &named(&manifest, ids)?, required, &dir, ui)
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
        settings.models.dir.clone_from(dir);
    }
    Ok(settings)
}

/// The models of those ids; none: all.
fn named<'m>(manifest: &'m Manifest, ids: &[String]) -> Result<Vec<&'m ModelEntry>> {
    if ids.is_empty() {
        return Ok(manifest.models.iter().collect());
    }
    ids.iter().map(|id| manifest.get(id)).collect()
}

/// Whether the file of a model is there with the right bytes.
fn state(entry: &ModelEntry, dir: &Path) -> &'static str {
    match sha256_of(&dir.join(&entry.file)) {
        Ok(found) if found.eq_ignore_ascii_case(&entry.sha256) => "present",
        Ok(_) => "wrong hash",
        Err(_) => "missing",
    }
}

fn list(manifest: &Manifest, chosen: &[&str], dir: &Path, ui: &Ui) -> Result<Outcome> {
    let (mut text, mut facts, mut n_missing) =
        (format!("models in {} (* chosen by the configuration)\n", dir.display()), Vec::new(), 0);
    for entry in &manifest.models {
        let state = state(entry, dir);
        let mark = if chosen.contains(&entry.id.as_str()) { "*" } else { " " };
        n_missing += usize::from(state != "present" && chosen.contains(&entry.id.as_str()));
        let Origin { repository, commit, path, licence, note } = &entry.origin;
        let role = format!("{:?}", entry.role).to_lowercase();
        text += &format!(
            "\n{mark} {:<26} {role:<7} {state:<11} {:5.1} MB  {}\n",
            entry.id,
            entry.bytes as f64 / 1e6,
            entry.file
        );
        text += &format!("    {}\n    from {repository} @ {commit} : {path}\n    licence {licence}\n", entry.about);
        let how = entry.url.as_ref().map(|url| format!("address {url}"));
        let how = how.or_else(|| entry.conversion.as_ref().map(|steps| format!("made by {steps}")));
        let lines = [Some(note.clone()).filter(|note| !note.is_empty()), how];
        text.extend(lines.into_iter().flatten().map(|line| format!("    {line}\n")));
        facts.push(json!({ "id": entry.id, "state": state, "entry": entry }));
    }
    let layouts: Vec<_> = manifest.layouts.iter().map(|entry| entry.id.as_str()).collect();
    text += &format!("\nlayouts for `add --like`, beside the models: {}", layouts.join(", "));
    let next = (n_missing > 0).then_some("orator models fetch");
    ui.summary(&text, next, json!({ "dir": dir, "models": facts, "layouts": layouts }));
    Ok(Outcome::Done)
}

fn fetch(entries: &[&ModelEntry], dir: &Path, mirror: Option<&Path>, ui: &Ui) -> Result<Outcome> {
    let offered = mirror.map(offered).transpose()?.unwrap_or_default();
    let (mut lines, mut facts, mut n_failed) = (Vec::new(), Vec::new(), 0);
    let task = ui.begin("models", entries.len() as u64);
    for entry in entries {
        task.detail(&entry.id);
        let place = dir.join(&entry.file);
        let got =
            if state(entry, dir) == "present" { Ok("there already".to_owned()) } else { get(entry, &place, &offered) };
        n_failed += usize::from(got.is_err());
        let said = got.as_ref().map_or_else(|error| format!("NOT HAD: {error:#}"), Clone::clone);
        lines.push(format!("{:<26} {said}", entry.id));
        facts.push(json!({ "id": entry.id, "had": got.is_ok(), "said": said }));
        task.advance(1);
    }
    drop(task);
    let next = if n_failed == 0 { "orator models check" } else { "orator models fetch --mirror DIR" };
    ui.summary(&lines.join("\n"), Some(next), json!({ "dir": dir, "models": facts }));
    Ok(if n_failed == 0 { Outcome::Done } else { Outcome::SomeFailed })
}

/// Hash and path of every file of a folder that may be a model.
fn offered(mirror: &Path) -> Result<Vec<(String, PathBuf)>> {
    let cannot = || format!("cannot read the folder {}", mirror.display());
    let mut offered = Vec::new();
    for file in std::fs::read_dir(mirror).with_context(cannot)? {
        let file = file.with_context(cannot)?;
        if file.metadata().is_ok_and(|meta| meta.is_file() && meta.len() <= MAX_BYTES) {
            offered.push((sha256_of(&file.path())?, file.path()));
        }
    }
    offered.sort();
    Ok(offered)
}

/// Puts a model's file in its place, from the mirror or its address; says from where.
fn get(entry: &ModelEntry, place: &Path, offered: &[(String, PathBuf)]) -> Result<String> {
    if let Some((_, path)) = offered.iter().find(|(hash, _)| hash.eq_ignore_ascii_case(&entry.sha256)) {
        copy(path, place)?;
        return Ok(format!("copied from {}", path.display()));
    }
    let Some(url) = &entry.url else {
        let steps = entry.conversion.as_deref().unwrap_or("no conversion is written down");
        bail!(
            "no address serves these bytes. They were made from {} @ {} : {} by: {steps}. A folder that has the file \
             (sha256 {}): --mirror DIR",
            entry.origin.repository,
            entry.origin.commit,
            entry.origin.path,
            entry.sha256
        )
    };
    let download =
        || -> Result<Vec<u8>> { Ok(ureq::get(url).call()?.body_mut().with_config().limit(MAX_BYTES).read_to_vec()?) };
    let bytes = download().with_context(|| format!("cannot download {url}"))?;
    workdir::replace(place, |attempt| {
        std::fs::write(attempt, &bytes)?;
        let found = sha256_of(attempt)?;
        ensure!(found.eq_ignore_ascii_case(&entry.sha256), "{url} serves sha256 {found}, expected {}", entry.sha256);
        Ok(())
    })?;
    Ok(format!("downloaded from {url}"))
}

fn copy(from: &Path, to: &Path) -> Result<()> {
    workdir::replace(to, |attempt| {
        std::fs::write(attempt, std::fs::read(from)?)?;
        Ok(())
    })
}

/// The description of a new file that is fed and read like a known one.
fn described(file: &Path, like: &ModelEntry, id: Option<&str>, licence: &str) -> Result<ModelEntry> {
    let name =
        file.file_name().and_then(|name| name.to_str()).with_context(|| format!("{} is no file", file.display()))?;
    let bytes = std::fs::metadata(file).with_context(|| format!("cannot read {}", file.display()))?.len();
    let stem = name.strip_suffix(".onnx").unwrap_or(name);
    Ok(ModelEntry {
        id: id.unwrap_or(stem).to_owned(),
        about: format!("Registered by hand, like {}.", like.id),
        file: name.to_owned(),
        sha256: sha256_of(file)?,
        bytes,
        url: None,
        conversion: Some("none: registered as it was".to_owned()),
        origin: Origin {
            repository: "registered by hand".to_owned(),
            commit: "none".to_owned(),
            path: name.to_owned(),
            licence: licence.to_owned(),
            note: String::new(),
        },
        ..like.clone()
    })
}

fn add(runtime: &Runtime, file: &Path, entry: &ModelEntry, dir: &Path, ui: &Ui) -> Result<Outcome> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Model::open(runtime, entry, folder).with_context(|| format!("{} is not like that", file.display()))?;
    let manifest_path = dir.join(MANIFEST_FILE);
    let written = match std::fs::read_to_string(&manifest_path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
        Err(error) => return Err(error).with_context(|| format!("cannot read {}", manifest_path.display())),
    };
    let own = Manifest { models: vec![entry.clone()], ..Manifest::default() };
    let text = format!("{}\n{}", written.trim_end(), toml::to_string(&own)?).trim_start().to_owned();
    Manifest::parse(&text).with_context(|| format!("{} cannot hold it; another id: --id", manifest_path.display()))?;
    let place = dir.join(&entry.file);
    if state(entry, dir) == "wrong hash" {
        bail!("{} is there already with other bytes: rename one of the two", place.display());
    }
    if state(entry, dir) == "missing" {
        copy(file, &place)?;
    }
    workdir::write_file(&manifest_path, text.as_bytes())?;
    let key = format!("{:?}", entry.role).to_lowercase();
    let said = format!("{} is registered in {} (sha256 {})", entry.id, manifest_path.display(), entry.sha256);
    ui.summary(&said, Some(&format!("orator run --set pose2d.{key}={}", entry.id)), json!({ "added": entry }));
    Ok(Outcome::Done)
}

fn check(
    runtime: &Runtime,
    entries: &[&ModelEntry],
    required: impl Fn(&ModelEntry) -> bool,
    dir: &Path,
    ui: &Ui,
) -> Result<Outcome> {
    let (mut lines, mut facts, mut n_failed) = (Vec::new(), Vec::new(), 0);
    for entry in entries {
        let optional = !required(entry) && !dir.join(&entry.file).exists();
        let problem = Model::open(runtime, entry, dir).err().map(|error| error.to_string());
        n_failed += usize::from(problem.is_some() && !optional);
        let said = match &problem {
            None => "right: bytes, names and shapes",
            Some(_) if optional => "missing (not chosen)",
            Some(problem) => problem,
        };
        lines.push(format!("{:<26} {said}", entry.id));
        facts.push(json!({ "id": entry.id, "right": problem.is_none(), "said": said }));
    }
    let next = (n_failed > 0).then_some("orator models fetch");
    ui.summary(&lines.join("\n"), next, json!({ "dir": dir, "models": facts }));
    Ok(if n_failed == 0 { Outcome::Done } else { Outcome::SomeFailed })
}
