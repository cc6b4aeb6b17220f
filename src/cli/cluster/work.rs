//! `orator work`.

use super::plan::open;
use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::Result;
use orator_base::stage::progress::{Event, Progress as _};
use orator_base::text::counted;
use orator_cluster::heartbeat::DEAD_AFTER;
use orator_cluster::worker::{WorkReport, WorkerOptions, work};
use serde_json::json;
use std::path::PathBuf;
use std::time::Duration;

/// Process units of a plan, alongside other workers.
///
/// Workers may run on any machine that can access the same folders. Each claims one unit at a time; units of a dead
/// worker are taken over, those of a slow one are not. A video that changed since the plan was written is rejected. The
/// first SIGTERM or Ctrl-C stops the worker after the current unit, the second immediately; the same command continues
/// the work.
///
/// Exit code 2: units failed or could not be claimed.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Plan written by `orator plan`.
    #[arg(long, value_name = "FILE")]
    plan: PathBuf,
    /// Number of units processed in parallel; 0 uses one per CPU core.
    #[arg(long, value_name = "N", default_value_t = 1)]
    jobs: usize,
    /// Process only part I of N of the units, I from 0 to N - 1, for job arrays with a fixed partition.
    #[arg(long, value_name = "I/N", value_parser = shard)]
    shard: Option<(usize, usize)>,
    /// Retry units that failed.
    #[arg(long)]
    retry: bool,
    /// Exit when all remaining units are claimed by other workers, instead of waiting to take over those of dead
    /// workers.
    #[arg(long)]
    no_wait: bool,
    /// Interval between heartbeats, seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 15.0)]
    heartbeat: f64,
    /// Time without a heartbeat after which another worker counts as dead, seconds; must exceed the cache time of the
    /// network file system.
    #[arg(long, value_name = "SECONDS", default_value_t = DEAD_AFTER.as_secs_f64())]
    claim_timeout: f64,
}

fn shard(text: &str) -> Result<(usize, usize), String> {
    let parsed = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    let shard = parsed.filter(|(i, n): &(usize, usize)| i < n);
    shard.ok_or_else(|| "expected I/N with I from 0 to N - 1".to_owned())
}

pub(crate) fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let (plan, pipeline) = open(&args.plan)?;
    pipeline.check()?.iter().for_each(|line| ui.event(&Event::Advice { line }));
    let cores = || std::thread::available_parallelism().map_or(1, |n| n.get());
    let secs = |secs: f64| Duration::try_from_secs_f64(secs.max(0.1)).unwrap_or(Duration::MAX);
    let options = WorkerOptions {
        jobs: if args.jobs == 0 { cores() } else { args.jobs },
        shard: args.shard,
        retry: args.retry,
        wait: !args.no_wait,
        beat: secs(args.heartbeat),
        dead_after: secs(args.claim_timeout),
    };
    ui.enable_stop_requests(
        "stopping after the current unit; a second signal exits at once",
        "completed stages are saved; run the same command again to continue",
    );
    let report = work(&plan, &args.plan, &pipeline, &options, ui)?;
    let path = args.plan.display();
    let has_failed = !report.failed.is_empty() || !report.failed_before.is_empty();
    let next = match report.all_ended {
        true if has_failed => format!("orator work --plan {path} --retry"),
        true => plan.datasets_command("orator"),
        false => format!("orator status --plan {path}"),
    };
    let mut facts = json!(report);
    facts["next"] = json!(next);
    ui.summary(&text(&report), Some(&next), facts);
    Ok(match (ui.was_stopped() && !report.all_ended, has_failed || !report.blocked.is_empty()) {
        (true, _) => Outcome::Stopped,
        (false, true) => Outcome::SomeFailed,
        (false, false) => Outcome::Done,
    })
}

fn text(report: &WorkReport) -> String {
    let (done, fresh, failed) = (counted(report.done, "unit"), report.up_to_date, report.failed.len());
    let mut lines = vec![format!("{done} done ({fresh} already up to date), {failed} failed")];
    if report.reclaimed + report.claim_lost > 0 {
        lines.push(format!(
            "{} taken over from dead workers, {} discarded because other workers had taken them over",
            counted(report.reclaimed, "unit"),
            report.claim_lost
        ));
    }
    lines.extend(report.failed.iter().map(|(unit, error)| format!("failed  {unit}: {error}")));
    lines.extend(report.failed_before.iter().map(|unit| format!("failed  {unit}: in an earlier session")));
    lines.extend(report.blocked.iter().map(|file| format!("blocked {file}; remove the file and start a worker again")));
    let rest = if report.all_ended {
        "all units are finished"
    } else {
        "some units are unclaimed or claimed by other workers"
    };
    lines.push(rest.to_owned());
    lines.join("\n")
}
