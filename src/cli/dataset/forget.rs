//! `orator forget`.

use crate::cli::Outcome;
use crate::cli::config_args::ConfigArgs;
use crate::cli::dataset::import::verify_deep;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, bail};
use orator_base::stage::artifacts::{StageName, speaker_dir};
use orator_base::stage::workdir::{self, FolderLock};
use orator_base::text::counted;
use orator_cluster::forget::plans_naming;
use orator_dataset::config::{Config, videos};
use orator_dataset::forget::known::{self, KnownVideo};
use orator_dataset::forget::removal::{Removal, models_dirs};
use orator_dataset::forget::search::{SearchReport, search};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Remove everything derived from a video or a speaker.
///
/// This covers the files of the stages, the dataset (shards, statistics, index, ledger, card, checksums), trained
/// models (a model cannot unlearn), plans of `orator plan` and the hash table. Shards of other videos stay unchanged
/// byte for byte. Afterwards every file in the work folder is searched for names and hashes of the video.
///
/// The video file itself and copies elsewhere are not deleted. Exit code 1: the search found remaining data.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    config: ConfigArgs,
    /// Video, given by its path, file name or work name.
    #[arg(long, value_name = "NAME|FILE", required_unless_present = "speaker")]
    video: Option<String>,
    /// Speaker of the video; without --video everything of the speaker is removed.
    #[arg(long, value_name = "NAME")]
    speaker: Option<String>,
    /// Remove the video from this dataset folder only; no configuration is read.
    #[arg(long, value_name = "DIR", requires = "video", conflicts_with_all = ["speaker", "keep_models"])]
    dataset: Option<PathBuf>,
    /// Do not remove models trained on the video, but list them.
    #[arg(long)]
    keep_models: bool,
    /// List what would be removed, without removing it.
    #[arg(long)]
    dry_run: bool,
}

/// What to remove, and where to search for remains.
struct ForgetTask {
    removals: Vec<Removal>,
    titles: Vec<String>,
    folders: Vec<PathBuf>,
    /// What the user must do so that the video does not come back, or should know.
    advice: Vec<String>,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    // The locks are held until the search is over, so that no other process recreates anything.
    let mut locks = Vec::new();
    let task = match &args.dataset {
        Some(dir) => of_dataset(dir, args.video.as_deref().unwrap_or_default(), args.dry_run, &mut locks)?,
        None => of_project(&args, &mut locks)?,
    };
    let lines: Vec<String> = task.removals.iter().flat_map(|removal| removal.lines(args.keep_models)).collect();
    let accepted: Vec<&PathBuf> = task.removals.iter().filter(|_| args.keep_models).flat_map(|r| &r.models).collect();
    let names = task.titles.join(", ");
    if args.dry_run {
        let text = match lines.is_empty() {
            true => format!("nothing to remove for {names}"),
            false => format!("would be removed for {names}:\n  {}", lines.join("\n  ")),
        };
        ui.summary(&text, None, json!({ "videos": task.titles, "would_remove": lines, "dry_run": true }));
        return Ok(Outcome::Done);
    }
    for removal in &task.removals {
        let done = removal.carry_out(args.keep_models);
        done.with_context(|| format!("{names}: removal is incomplete; run the same command again to finish"))?;
    }
    let terms: Vec<_> = task.removals.iter().flat_map(|removal| removal.terms.clone()).collect();
    let mut searched = search(&task.folders, &terms).context("cannot verify the removal")?;
    // A model that stays lists its training videos; it is reported as such instead.
    searched.hits.retain(|hit| !accepted.iter().any(|model| Path::new(&hit.file).starts_with(model)));
    let mut text = match lines.is_empty() {
        true => vec![format!("found nothing to remove for {names}")],
        false => vec![format!("removed {names}:"), format!("  {}", lines.join("\n  "))],
    };
    text.extend(accepted.iter().map(|model| format!("retained, although trained on it: {}", model.display())));
    text.extend(task.advice.iter().cloned());
    text.extend(searched.hits.iter().map(|found| match found.at {
        Some(at) => format!("FOUND   {} at byte {at}: {}", found.file, found.term),
        None => format!("FOUND   {}: {} in the file name", found.file, found.term),
    }));
    let SearchReport { n_files, bytes, inside_bytes, hits } = &searched;
    text.push(format!(
        "searched {}, {bytes} bytes and {inside_bytes} bytes inside archives, for {} and hashes: {}",
        counted(*n_files, "file"),
        counted(terms.len(), "name"),
        counted(hits.len(), "hit")
    ));
    let found: Vec<_> = hits.iter().map(|hit| json!({ "file": hit.file, "at": hit.at, "term": hit.term })).collect();
    let next = match &args.dataset {
        Some(dir) => verify_deep(dir),
        None => format!("orator status{}", args.config.flags()),
    };
    let facts = json!({
        "videos": task.titles, "removed": lines, "retained_models": accepted, "advice": task.advice, "found": found,
        "next": next,
        "searched": { "files": n_files, "bytes": bytes, "inside_bytes": inside_bytes, "marks": terms.len() },
    });
    ui.summary(&text.join("\n"), Some(&next), facts);
    Ok(if hits.is_empty() { Outcome::Done } else { Outcome::CheckFailed })
}

/// Error context if a folder is in use.
const IN_USE: &str = "nothing was removed: the process that uses the folder could recreate the data";

fn of_dataset(dir: &Path, wanted: &str, dry_run: bool, locks: &mut Vec<FolderLock>) -> Result<ForgetTask> {
    let dir = std::path::absolute(dir)?;
    if !dry_run {
        locks.push(FolderLock::exclusive(&dir).context(IN_USE)?);
    }
    let all = known::dataset_videos(&dir)?;
    let video = known::find_one(&all, wanted, None)?;
    let others: Vec<&KnownVideo> = all.iter().filter(|k| *k != video).collect();
    let removal = Removal::of_dataset(&dir, &[video], &others);
    let mut folders = vec![dir.clone()];
    folders.extend(workdir::left_over(&dir));
    let advice = vec!["models trained on this dataset and copies of it are not searched".to_owned()];
    Ok(ForgetTask {
        titles: vec![video.display_name().trim_start_matches('/').to_owned()],
        removals: vec![removal],
        folders,
        advice,
    })
}

fn of_project(args: &Args, locks: &mut Vec<FolderLock>) -> Result<ForgetTask> {
    let config = args.config.load()?;
    let work = &config.settings.work.dir;
    let is_locked = !args.dry_run && work.exists();
    if is_locked {
        locks.push(workdir::lock(work).context(IN_USE)?);
        locks.push(FolderLock::exclusive(work).context(IN_USE)?);
        for entry in std::fs::read_dir(work.join(StageName::Dataset.as_str())).into_iter().flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let hidden = name.strip_prefix('.').and_then(|name| name.strip_suffix(".old"));
            if let Some(speaker) = hidden.or(Some(&*name).filter(|name| !name.starts_with('.'))) {
                // A killed `forget` may have left a video there that is recorded nowhere else.
                workdir::recover_folder(&speaker_dir(work, StageName::Dataset, speaker))?;
            }
        }
    }
    let all = known::project_videos(&config)?;
    let (videos, whole) = match (&args.video, &args.speaker) {
        (Some(video), speaker) => (vec![known::find_one(&all, video, speaker.as_deref())?], false),
        (None, Some(speaker)) => (known::speaker_videos(&all, speaker)?, true),
        (None, None) => bail!("give --video or --speaker"),
    };
    let speaker = videos.first().map(|video| video.speaker.clone()).unwrap_or_default();
    if is_locked {
        let dataset = speaker_dir(work, StageName::Dataset, &speaker);
        for folder in [dataset]
            .iter()
            .chain(&models_dirs(work, &speaker))
            .filter(|folder| folder.parent().is_some_and(Path::exists))
        {
            locks.push(FolderLock::exclusive(folder).context(IN_USE)?);
        }
    }
    let others: Vec<&KnownVideo> = all.iter().filter(|k| !videos.contains(k)).collect();
    let mut removal = Removal::of_work(work, &speaker, &videos, &others, whole)?;
    removal.add_decisions(&config.file, &videos)?;
    let plans = plans_naming(work, &removal.terms)?;
    if is_locked {
        let own = models_dirs(work, &speaker);
        for folder in removal.models.iter().filter(|folder| !own.contains(folder)) {
            locks.push(FolderLock::exclusive(folder).context(IN_USE)?);
        }
    }
    let mut advice: Vec<String> = Vec::new();
    if plans.iter().any(|path| path.extension().is_some_and(|it| it == "json")) {
        advice.push("the plan that listed it was removed: run `orator plan` again before starting workers".to_owned());
    }
    removal.paths.extend(plans);
    advice.push("plans written outside the work folder (`orator plan --out`) are not searched: delete them".to_owned());
    for video in &videos {
        let twins = others.iter().filter(|other| video.content.is_some() && other.content == video.content);
        advice.extend(twins.map(|twin| {
            format!("{} has the same content and was not removed; run `orator forget` for it too", twin.display_name())
        }));
    }
    advice.extend(prevention_advice(&config, &speaker, &videos, whole));
    let titles = if whole { vec![speaker] } else { videos.iter().map(|video| video.display_name()).collect() };
    Ok(ForgetTask { titles, removals: vec![removal], folders: vec![work.clone()], advice })
}

/// Advice that prevents the next run from recreating the videos; `None` if it would not.
fn prevention_advice(config: &Config, speaker: &str, gone: &[&KnownVideo], whole: bool) -> Option<String> {
    let named =
        videos::all(config).into_iter().filter(|videos| videos.speaker == speaker).flat_map(|videos| videos.units);
    let back: Vec<PathBuf> =
        named.map(|unit| unit.source).filter(|source| gone.iter().any(|k| k.source.as_ref() == Some(source))).collect();
    if back.is_empty() {
        return None;
    }
    if whole {
        return Some(format!(
            "remove [[speaker]] {speaker} from {}, or the next run recreates the data",
            config.file.display()
        ));
    }
    let folder = config.file.parent().unwrap_or(Path::new("."));
    let relative = |path: &PathBuf| path.strip_prefix(folder).unwrap_or(path).to_string_lossy().into_owned();
    let configured = config.settings.speaker.iter().find(|s| s.name == speaker);
    let mut list: Vec<String> = configured.map(|speaker| speaker.exclude.clone()).unwrap_or_default();
    list.extend(back.iter().map(relative));
    Some(format!(
        "delete the video file, or add to [[speaker]] {speaker} in {} the line\n  exclude = {list:?}\n\
         or the next run recreates the data",
        config.file.display()
    ))
}
