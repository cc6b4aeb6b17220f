//! `orator status --plan`.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::Result;
use orator_cluster::heartbeat::DEAD_AFTER;
use orator_cluster::plan::ClusterPlan;
use orator_cluster::progress::{PlanProgress, WorkerProgress, progress};
use serde_json::json;
use std::path::Path;

/// Prints how far the workers of a plan are.
pub(crate) fn run(path: &Path, ui: &Ui) -> Result<Outcome> {
    let plan = ClusterPlan::read(path)?;
    let told = progress(&plan, path, DEAD_AFTER)?;
    let next = match told.n_done + told.n_failed == told.n_units {
        true if told.n_failed > 0 => format!("orator work --plan {} --retry", path.display()),
        true => plan.datasets_command("orator"),
        false => format!("orator work --plan {}", path.display()),
    };
    let mut facts = json!(told);
    facts["next"] = json!(next);
    ui.summary(&text(&told), Some(&next), facts);
    Ok(Outcome::Done)
}

fn text(told: &PlanProgress) -> String {
    let hours = |secs: f64| secs / 3600.0;
    let mut lines = vec![format!(
        "{} units: {} done, {} failed, {} in work, {} left by dead workers, {} free; {} taken over",
        told.n_units,
        told.n_done,
        told.n_failed,
        told.n_claimed,
        told.n_left_by_dead,
        told.n_units - told.n_done - told.n_failed - told.n_claimed - told.n_left_by_dead,
        told.n_taken_over
    )];
    let left = told.secs_left.map_or("unknown".to_owned(), |secs| format!("{:.2} h", hours(secs)));
    let (ended, all) = (hours(told.ended_media_secs), hours(told.media_secs));
    lines.push(format!("{ended:.2} of {all:.2} h of video; time left at this pace: {left}"));
    lines.extend(told.stopped.iter().map(|reason| format!("all workers have stopped: {reason}")));
    lines.extend(told.workers.iter().map(worker));
    lines.extend(told.failures.iter().map(|(reason, units)| {
        let first = units.first().map(String::as_str).unwrap_or_default();
        format!("failed  {} x {reason} ({first})", units.len())
    }));
    lines.join("\n")
}

fn worker(worker: &WorkerProgress) -> String {
    let WorkerProgress { worker, is_alive, heartbeat, silent_secs } = worker;
    let state = match (heartbeat.ended, is_alive) {
        (true, _) => "ended".to_owned(),
        (false, true) => heartbeat.unit.as_ref().map_or("waits".to_owned(), |unit| format!("works on {unit}")),
        (false, false) => format!("dead, silent for {silent_secs:.0} s"),
    };
    let (done, failed, rate) = (heartbeat.n_done, heartbeat.n_failed, heartbeat.media_rate());
    format!("worker  {worker}: {done} done, {failed} failed, {rate:.2} s of video a second; {state}")
}
