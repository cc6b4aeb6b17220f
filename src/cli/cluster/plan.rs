//! `orator plan`, and the progress of its workers.

use crate::cli::Outcome;
use crate::cli::config_args::ConfigArgs;
use crate::cli::sandbox::this_program;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, bail};
use orator_base::stage::workdir::FolderLock;
use orator_base::text::{counted, duration, length};
use orator_cluster::heartbeat::DEAD_AFTER;
use orator_cluster::plan::{ClusterPlan, PART_SECS};
use orator_cluster::progress::{PlanProgress, WorkerProgress, progress};
use orator_dataset::config;
use orator_pipeline::Pipeline;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Write a plan for cluster workers.
///
/// `orator work` and `orator submit` read the plan. Each video is hashed unless its hash is known; workers reject a
/// video that changes afterwards.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    config: ConfigArgs,
    /// Plan file to write; defaults to plan.json in the work folder.
    #[arg(long, short_alias = 'o', value_name = "FILE")]
    out: Option<PathBuf>,
    /// Length of the parts into which a long video is split for workers, minutes.
    #[arg(long, value_name = "MINUTES", default_value_t = PART_SECS / 60.0)]
    max_part: f64,
}

/// Reads a plan and its pipeline, and checks that they still match.
pub(crate) fn open(path: &Path) -> Result<(ClusterPlan, Pipeline)> {
    let plan = ClusterPlan::read(path)?;
    let config = config::load(&plan.config, &plan.sets)?;
    let pipeline = Pipeline::open(config)?.with_processes(this_program());
    plan.check(&pipeline, &this_program())?;
    Ok((plan, pipeline))
}

pub(crate) fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    if !args.max_part.is_finite() || args.max_part < 1.0 {
        bail!("--max-part: expected at least 1 minute");
    }
    let pipeline = Pipeline::open(args.config.load()?)?.with_processes(this_program());
    let work = &pipeline.config().settings.work.dir;
    let out = std::path::absolute(args.out.unwrap_or_else(|| work.join("plan.json")))?;
    let secs = |path: &Path| pipeline.ask_media(path).ok().flatten();
    // The shared lock prevents `orator forget` from running at the same time.
    let lock = FolderLock::shared(work).context("cannot write a plan now")?;
    let plan = ClusterPlan::new(&pipeline, &args.config.set, &this_program(), &secs, 60.0 * args.max_part, ui)?;
    plan.write(&out)?;
    drop(lock);
    let videos = plan.videos();
    let total_secs: f64 = videos.iter().filter_map(|unit| unit.secs).sum();
    let (n_units, n_videos) = (counted(plan.units.len(), "unit"), counted(videos.len(), "video"));
    let next = format!("orator work --plan {}", out.display());
    let facts = json!({ "plan": out, "units": plan.units.len(), "hours": total_secs / 3600.0, "next": next });
    let text = format!("{n_units} of {n_videos}, {} in total\nplan     {}", length(total_secs), out.display());
    ui.summary(&text, Some(&next), facts);
    Ok(Outcome::Done)
}

/// Prints the progress of the workers of a plan: `orator status --plan`.
pub(crate) fn show_progress(path: &Path, ui: &Ui) -> Result<Outcome> {
    let plan = ClusterPlan::read(path)?;
    let summary = progress(&plan, path, DEAD_AFTER)?;
    let next = match summary.n_done + summary.n_failed == summary.n_units {
        true if summary.n_failed > 0 => format!("orator work --plan {} --retry", path.display()),
        true => plan.datasets_command("orator"),
        false => format!("orator work --plan {}", path.display()),
    };
    let mut facts = json!(summary);
    facts["next"] = json!(next);
    ui.summary(&progress_text(&summary), Some(&next), facts);
    Ok(Outcome::Done)
}

fn progress_text(progress: &PlanProgress) -> String {
    let PlanProgress { n_units, n_done, n_failed, n_claimed, n_left_by_dead, n_reclaimed, .. } = progress;
    let n_free = n_units - n_done - n_failed - n_claimed - n_left_by_dead - progress.blocked.len();
    let mut lines = vec![format!(
        "{}: {n_done} done, {n_failed} failed, {n_claimed} in progress, {n_left_by_dead} left by dead workers, \
         {n_free} unclaimed; {n_reclaimed} taken over",
        counted(*n_units, "unit")
    )];
    let left = progress.secs_left.map_or("unknown".to_owned(), length);
    let (ended, all) = (length(progress.ended_media_secs), length(progress.media_secs));
    lines.push(format!("{ended} of {all} of video processed; estimated time left: {left}"));
    lines.extend(
        progress
            .blocked
            .iter()
            .map(|file| format!("blocked by {}: not written by a worker; remove this file", file.display())),
    );
    lines.extend(progress.stopped.iter().map(|reason| format!("all workers have stopped: {reason}")));
    lines.extend(progress.workers.iter().map(worker));
    lines.extend(progress.failures.iter().map(|(reason, units)| {
        let first = units.first().map(String::as_str).unwrap_or_default();
        format!("failed  {} x {reason} ({first})", units.len())
    }));
    lines.join("\n")
}

fn worker(worker: &WorkerProgress) -> String {
    let WorkerProgress { worker, is_alive, heartbeat, silent_secs } = worker;
    let state = match (heartbeat.ended, is_alive) {
        (true, _) => "ended".to_owned(),
        (false, true) => heartbeat.unit.as_ref().map_or("waiting".to_owned(), |unit| format!("processing {unit}")),
        (false, false) => format!("dead, no heartbeat for {}", duration(*silent_secs)),
    };
    let (done, failed, rate) = (heartbeat.n_done, heartbeat.n_failed, heartbeat.media_rate());
    format!("worker  {worker}: {done} done, {failed} failed, {rate:.2} s of video per second; {state}")
}
