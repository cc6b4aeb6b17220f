//! `orator plan`, and the progress of its workers.

use crate::cli::Outcome;
use crate::cli::config_args::ConfigArgs;
use crate::cli::sandbox::this_program;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, bail};
use orator_base::stage::artifacts::StageName;
use orator_base::stage::workdir::FolderLock;
use orator_base::text::{counted, duration, length, number};
use orator_cluster::heartbeat::DEAD_AFTER;
use orator_cluster::plan::{ClusterPlan, PART_SECS, PlannedUnit};
use orator_cluster::progress::{PlanProgress, WorkerProgress, progress};
use orator_cluster::stage_times::StageTimes;
use orator_cluster::timing;
use orator_dataset::config;
use orator_pipeline::Pipeline;
use orator_pipeline::process::message::MediaRequest;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Write a plan for cluster workers, with time estimates.
///
/// `orator work` and `orator submit` read the plan. Each video is hashed unless its hash is known; workers reject a
/// video that changes afterwards. The stages are timed on excerpts of the videos on this machine, which should be
/// idle. The times are saved and reused until the program, the settings, the models or the machine change.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    config: ConfigArgs,
    /// Plan file to write; defaults to plan.json in the work folder.
    #[arg(long, short_alias = 'o', value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print the estimated duration with this number of workers.
    #[arg(long, value_name = "N")]
    workers: Option<usize>,
    /// Print the number of workers needed to finish within this number of hours.
    #[arg(long, value_name = "HOURS")]
    hours: Option<f64>,
    /// Length of the parts into which a long video is split for workers, minutes.
    #[arg(long, value_name = "MINUTES", default_value_t = PART_SECS / 60.0)]
    max_part: f64,
    /// Do not time the stages, and print no estimates.
    #[arg(long, conflicts_with_all = ["workers", "hours"])]
    no_timing: bool,
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
    if args.workers == Some(0) || args.hours.is_some_and(|hours| !hours.is_finite() || hours <= 0.0) {
        bail!("--workers: expected at least 1; --hours: expected more than 0");
    }
    if !args.max_part.is_finite() || args.max_part < 1.0 {
        bail!("--max-part: expected at least 1 minute");
    }
    let pipeline = Pipeline::open(args.config.load()?)?.with_processes(this_program());
    let work = &pipeline.config().settings.work.dir;
    let out = std::path::absolute(args.out.unwrap_or_else(|| work.join("plan.json")))?;
    let secs = |path: &Path| {
        let request = MediaRequest { source: path.to_owned(), excerpt: None };
        pipeline.ask_media(&request).ok().flatten()
    };
    // The shared lock prevents `orator forget` from running at the same time.
    let lock = FolderLock::shared(work).context("cannot write a plan now")?;
    let plan = ClusterPlan::new(&pipeline, &args.config.set, &this_program(), &secs, 60.0 * args.max_part, ui)?;
    plan.write(&out)?;
    drop(lock);
    let videos = plan.videos();
    let lengths: Vec<f64> = videos.iter().filter_map(|unit| unit.secs).collect();
    let total_secs: f64 = lengths.iter().sum();
    let (n_units, n_videos) = (counted(plan.units.len(), "unit"), counted(videos.len(), "video"));
    let mut lines = vec![format!("{n_units} of {n_videos}, {} in total", length(total_secs))];
    let next = format!("orator work --plan {}", out.display());
    let mut facts = json!({ "plan": out, "units": plan.units.len(), "hours": total_secs / 3600.0, "next": next });
    if !args.no_timing && !lengths.is_empty() {
        let times = times(&pipeline, &videos, ui)?;
        lines.extend(prediction_lines(&times, &lengths));
        facts["stages"] = stages(&times, &lengths);
        facts["peak_mib"] = json!(times.peak_mib);
        let mut wall = |workers: usize| {
            let secs = times.wall_secs(&lengths, workers);
            lines.push(format!("{:<13}estimated time {}", counted(workers, "worker"), duration(secs)));
            facts["wall_secs"][workers.to_string()] = json!(secs);
        };
        let workers: BTreeSet<usize> = [1, times.jobs].into_iter().chain(args.workers).collect();
        workers.into_iter().for_each(&mut wall);
        if let Some(hours) = args.hours {
            let needed = times.workers_within(&lengths, 3600.0 * hours);
            facts["workers_needed"] = json!(needed);
            lines.push(match needed {
                Some(n) => format!("to finish within {} h: {}", number(hours), counted(n, "worker")),
                None => format!(
                    "no number of workers finishes within {} h: the longest unit alone takes {}",
                    number(hours),
                    duration(times.wall_secs(&lengths, usize::MAX))
                ),
            });
        }
    }
    lines.push(format!("plan     {}", out.display()));
    ui.summary(&lines.join("\n"), Some(&next), facts);
    Ok(Outcome::Done)
}

/// The saved stage times if they are valid for this program, these settings and this machine; otherwise measures them.
fn times(pipeline: &Pipeline, units: &[PlannedUnit], ui: &Ui) -> Result<StageTimes> {
    let (work, jobs) = (&pipeline.config().settings.work.dir, pipeline.jobs(None));
    let fingerprint = timing::fingerprint(pipeline, &this_program(), jobs)?;
    if let Some(known) = StageTimes::read(work).filter(|known| known.fingerprint == fingerprint) {
        return Ok(known);
    }
    let times = timing::measure(pipeline, &this_program(), units, jobs, ui)?;
    times.write(work)?;
    Ok(times)
}

fn prediction_lines(times: &StageTimes, lengths: &[f64]) -> Vec<String> {
    let total_secs: f64 = lengths.iter().sum();
    let stage = |stage: StageName| {
        let gib = times.cost(stage).bytes_per_sec * total_secs / f64::from(1 << 30);
        format!("{stage:10}{:>10} of processing{gib:8.2} GiB of files", duration(times.stage_secs(stage, lengths)))
    };
    let mut lines: Vec<String> = times.timed_stages().map(stage).collect();
    let StageTimes { excerpt_secs, jobs, processor, .. } = times;
    let excerpts = counted(times.n_excerpts, "excerpt");
    lines.push(format!("timed on {excerpts} of {excerpt_secs:.0} s in total, {jobs} in parallel, {processor}"));
    lines.extend(times.peak_mib.map(|mib| format!("memory   {mib:.0} MiB per worker")));
    lines
}

fn stages(times: &StageTimes, lengths: &[f64]) -> Value {
    let total_secs: f64 = lengths.iter().sum();
    let stage = |stage: StageName| {
        let bytes = times.cost(stage).bytes_per_sec * total_secs;
        (stage.to_string(), json!({ "work_secs": times.stage_secs(stage, lengths), "bytes": bytes }))
    };
    times.timed_stages().map(stage).collect::<serde_json::Map<String, Value>>().into()
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
