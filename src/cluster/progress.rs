//! Progress of all workers of a plan, read from the files in their folder.

use super::claims::{Claim, ClaimOwner, ClaimState, read_states};
use super::heartbeat::{Heartbeat, WORKERS, this_machine};
use super::plan::ClusterPlan;
use super::shared_folder::{DiskFolder, SharedFolder};
use super::worker::read_stop;
use anyhow::{Context, Result};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PlanProgress {
    pub n_units: usize,
    pub n_done: usize,
    pub n_failed: usize,
    /// Units claimed by live workers, and by dead ones.
    pub n_claimed: usize,
    pub n_left_by_dead: usize,
    /// Paths that occupy a unit without being a worker's claim: a folder, a pipe or a damaged file.
    pub blocked: Vec<PathBuf>,
    /// Units that were claimed more than once.
    pub n_reclaimed: usize,
    /// Duration of the video in all units and in those that have ended, seconds; units of unknown length count 0.
    pub media_secs: f64,
    pub ended_media_secs: f64,
    /// Estimated seconds until the end at the rate of the live workers; `None` if the rate is unknown.
    pub secs_left: Option<f64>,
    /// Failed units, by error.
    pub failures: BTreeMap<String, Vec<String>>,
    /// All workers that have published a heartbeat, by name.
    pub workers: Vec<WorkerProgress>,
    /// Reason why all workers have stopped.
    pub stopped: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorkerProgress {
    pub worker: String,
    pub is_alive: bool,
    #[serde(flatten)]
    pub heartbeat: Heartbeat,
    /// Seconds since the last heartbeat, by the file server's clock.
    pub silent_secs: f64,
}

/// Reads the progress of the plan at `path`. A worker without a heartbeat for `dead_after` counts as dead.
pub fn progress(plan: &ClusterPlan, path: &Path, dead_after: Duration) -> Result<PlanProgress> {
    let folder = DiskFolder(plan.folder(path));
    let workers = workers(&folder, dead_after)?;
    let is_alive = |name: &str| workers.iter().any(|worker| worker.worker == name && worker.is_alive);
    let states = read_states(&folder, plan.units.len())?;
    let mut summary = PlanProgress { n_units: plan.units.len(), ..PlanProgress::default() };
    for (unit, (planned, ClaimState { epoch, has_ended })) in plan.units.iter().zip(states).enumerate() {
        let (claim, secs) = (Claim { unit, epoch }, planned.media_secs().unwrap_or(0.0));
        summary.media_secs += secs;
        summary.n_reclaimed += usize::from(epoch > 1);
        if !has_ended && epoch > 0 {
            match claim.read_owner(&folder)? {
                ClaimOwner::Worker(worker) if is_alive(&worker) => summary.n_claimed += 1,
                ClaimOwner::Worker(_) | ClaimOwner::NotVisible => summary.n_left_by_dead += 1,
                ClaimOwner::Unreadable(file) => summary.blocked.push(folder.0.join(file)),
            }
        } else if has_ended {
            summary.ended_media_secs += secs;
            match claim.read_end(&folder)?.and_then(|end| end.error) {
                None => summary.n_done += 1,
                Some(error) => {
                    summary.n_failed += 1;
                    summary.failures.entry(reason(&error)).or_default().push(planned.to_string());
                }
            }
        }
    }
    let rate: f64 = workers.iter().filter(|worker| worker.is_alive).map(|worker| worker.heartbeat.media_rate()).sum();
    summary.secs_left = (rate > 0.0).then(|| (summary.media_secs - summary.ended_media_secs) / rate);
    summary.stopped = read_stop(&folder)?;
    summary.workers = workers;
    Ok(summary)
}

/// An error without the paths in it, so that units that fail for one cause are listed together.
pub fn reason(error: &str) -> String {
    let parts = error.split(": ").map(|part| {
        let words = part.split(' ').map(|word| if word.contains('/') { "FILE" } else { word });
        words.collect::<Vec<_>>().join(" ")
    });
    parts.filter(|part| part != "FILE").collect::<Vec<_>>().join(": ")
}

fn workers(folder: &DiskFolder, dead_after: Duration) -> Result<Vec<WorkerProgress>> {
    let mut names = folder.list(WORKERS)?;
    names.sort();
    if names.is_empty() {
        return Ok(Vec::new());
    }
    let (_, machine) = this_machine();
    // A fresh file gives the time of the file server, independent of this machine's clock.
    let probe = folder.0.join(WORKERS).join(format!(".now-{}", std::process::id()));
    let changed = |path: &Path| fs::metadata(path).and_then(|meta| meta.modified());
    fs::write(&probe, b"now").with_context(|| format!("cannot write to {}", folder.0.display()))?;
    let now = changed(&probe);
    let _ = fs::remove_file(&probe);
    let now = now?;
    let mut workers = Vec::new();
    for name in names {
        let Some(worker) = name.strip_suffix(".json") else { continue };
        let Some(heartbeat) = Heartbeat::read(folder, worker)? else { continue };
        let silent = changed(&folder.0.join(WORKERS).join(&name)).ok().and_then(|time| now.duration_since(time).ok());
        let silent = silent.unwrap_or_default();
        let is_alive = !heartbeat.is_over(&machine) && silent < dead_after;
        let silent_secs = silent.as_secs_f64();
        workers.push(WorkerProgress { worker: worker.to_owned(), is_alive, heartbeat, silent_secs });
    }
    Ok(workers)
}
