//! How far the workers of a plan are, from their files alone.

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

/// What the workers of a plan have done.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PlanProgress {
    pub n_units: usize,
    pub n_done: usize,
    pub n_failed: usize,
    /// In the hands of workers that are alive, and of dead ones.
    pub n_claimed: usize,
    pub n_left_by_dead: usize,
    /// Units held by what is no claim of a worker: a folder, a pipe, or a damaged file.
    pub blocked: Vec<PathBuf>,
    /// Units that were taken over once or more.
    pub n_taken_over: usize,
    /// Seconds of video of all units, and of those that have ended; without those of unknown length.
    pub media_secs: f64,
    pub ended_media_secs: f64,
    /// Seconds until the end at the pace of the workers that are alive; none where that is not known.
    pub secs_left: Option<f64>,
    /// Failed units by the reason.
    pub failures: BTreeMap<String, Vec<String>>,
    /// Those at work or gone, by name.
    pub workers: Vec<WorkerProgress>,
    /// Why all workers have stopped.
    pub stopped: Option<String>,
}

/// What a worker has done.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorkerProgress {
    pub worker: String,
    pub is_alive: bool,
    #[serde(flatten)]
    pub heartbeat: Heartbeat,
    /// Seconds since it was last heard, by the file server's clock.
    pub silent_secs: f64,
}

/// Reads how far the plan at `path` is. A worker that was silent for `dead_after` is dead.
pub fn progress(plan: &ClusterPlan, path: &Path, dead_after: Duration) -> Result<PlanProgress> {
    let folder = DiskFolder(plan.folder(path));
    let workers = workers(&folder, dead_after)?;
    let is_alive = |name: &str| workers.iter().any(|worker| worker.worker == name && worker.is_alive);
    let states = read_states(&folder, plan.units.len())?;
    let mut told = PlanProgress { n_units: plan.units.len(), ..PlanProgress::default() };
    for (unit, (planned, ClaimState { epoch, has_ended })) in plan.units.iter().zip(states).enumerate() {
        let (claim, secs) = (Claim { unit, epoch }, planned.media_secs().unwrap_or(0.0));
        told.media_secs += secs;
        told.n_taken_over += usize::from(epoch > 1);
        if !has_ended && epoch > 0 {
            match claim.read_owner(&folder)? {
                ClaimOwner::Worker(worker) if is_alive(&worker) => told.n_claimed += 1,
                ClaimOwner::Worker(_) | ClaimOwner::NotVisible => told.n_left_by_dead += 1,
                ClaimOwner::Unreadable(file) => told.blocked.push(folder.0.join(file)),
            }
        } else if has_ended {
            told.ended_media_secs += secs;
            match claim.read_end(&folder)?.and_then(|end| end.error) {
                None => told.n_done += 1,
                Some(error) => {
                    told.n_failed += 1;
                    told.failures.entry(reason(&error)).or_default().push(planned.to_string());
                }
            }
        }
    }
    let rate: f64 = workers.iter().filter(|worker| worker.is_alive).map(|worker| worker.heartbeat.media_rate()).sum();
    told.secs_left = (rate > 0.0).then(|| (told.media_secs - told.ended_media_secs) / rate);
    told.stopped = read_stop(&folder)?;
    told.workers = workers;
    Ok(told)
}

/// The innermost cause of an error, which units of one trouble share.
fn reason(error: &str) -> String {
    error.rsplit(": ").next().unwrap_or(error).to_owned()
}

/// All workers that have said something.
fn workers(folder: &DiskFolder, dead_after: Duration) -> Result<Vec<WorkerProgress>> {
    let mut names = folder.list(WORKERS)?;
    names.sort();
    if names.is_empty() {
        return Ok(Vec::new());
    }
    let (_, machine) = this_machine();
    // The time of the file server, whatever this machine's clock says.
    let probe = folder.0.join(WORKERS).join(format!(".now-{}", std::process::id()));
    let changed = |path: &Path| fs::metadata(path).and_then(|meta| meta.modified());
    fs::write(&probe, b"now").with_context(|| format!("cannot write in {}", folder.0.display()))?;
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
