//! A worker claims units of a plan one after the other and runs their stages until every unit has ended or it is asked
//! to stop. Any number of workers on any machines may share a plan.

use super::claims::{Claim, ClaimOptions, Claims, NextUnit, UnitEnd, read_states};
use super::heartbeat::{BeatWatch, Heartbeat, this_machine};
use super::plan::{ClusterPlan, PlannedUnit, UnitShare};
use super::shared_folder::{DiskFolder, SharedFolder};
use anyhow::{Context, Result, anyhow, bail};
use orator_base::stage::artifacts::StageName;
use orator_base::stage::fingerprint::HashCache;
use orator_base::stage::progress::Progress;
use orator_base::stage::runner::{ClaimLost, StageOutcome};
use orator_base::stage::workdir::{self, NoSpace};
use orator_pipeline::Pipeline;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// File that stops every worker of a plan; it contains the reason.
pub const STOP: &str = "stop.txt";

#[derive(Clone, Debug, PartialEq)]
pub struct WorkerOptions {
    /// Number of units in parallel, each under its own claim.
    pub jobs: usize,
    /// Share `i` of `n` (`i` from 0) of the videos in a job array; `None` for any unit.
    pub shard: Option<(usize, usize)>,
    /// Whether to retry units that had failed.
    pub retry: bool,
    /// Whether to wait for units claimed by other workers, in order to take over those of dead ones.
    pub wait: bool,
    /// Time between two heartbeats.
    pub beat: Duration,
    /// Time without a heartbeat after which another worker counts as dead.
    pub dead_after: Duration,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct WorkReport {
    /// Number of units done, including those that were up to date.
    pub done: usize,
    /// Number of units done whose stages were all up to date before.
    pub up_to_date: usize,
    pub failed: Vec<(String, String)>,
    /// Units that had failed in an earlier session and were not processed again, once every unit has ended.
    pub failed_before: Vec<String>,
    /// Number of units claimed again after their worker died.
    pub reclaimed: usize,
    /// Number of units given up because another worker had claimed them again.
    pub claim_lost: usize,
    /// Units that cannot be claimed or ended, each with the foreign file at the path of its claim or end.
    pub blocked: BTreeSet<String>,
    /// Whether every unit of the plan, or of this process's share, has ended.
    pub all_ended: bool,
}

/// Reason why all workers must stop; `None` if they need not.
pub(super) fn read_stop(folder: &DiskFolder) -> Result<Option<String>> {
    let text = |reason: Vec<u8>| match reason.is_empty() {
        true => format!("stop file {}", folder.0.join(STOP).display()),
        false => String::from_utf8_lossy(&reason).into_owned(),
    };
    Ok(folder.read(STOP)?.map(text))
}

/// Processes the plan at `path`.
///
/// # Errors
/// The shared folder cannot be written, the work folder is locked, or the disk is full (which stops every worker).
pub fn work(
    plan: &ClusterPlan,
    path: &Path,
    pipeline: &Pipeline,
    options: &WorkerOptions,
    progress: &dyn Progress,
) -> Result<WorkReport> {
    let folder = DiskFolder(plan.folder(path));
    resume_after_stop(&folder)?;
    let dir = &pipeline.config().settings.work.dir;
    let _lock = workdir::lock_shared(dir).context("cannot start a worker")?;
    workdir::sweep_folder(dir, 2);
    let (host, machine) = this_machine();
    let hashes = pipeline.hashes();
    let session = Session {
        plan,
        folder,
        pipeline,
        options,
        progress,
        hashes: &hashes,
        begun: Instant::now(),
        machine: &machine,
        report: Mutex::default(),
        is_broken: AtomicBool::new(false),
    };
    let started = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
    let first = Heartbeat {
        host: host.clone(),
        machine: machine.clone(),
        pid: std::process::id(),
        started,
        ..Heartbeat::default()
    };
    let run = || {
        let ended = session.run(&worker_name(&host), first.clone());
        session.is_broken.fetch_or(ended.is_err(), Ordering::Relaxed);
        ended
    };
    let ended: Result<()> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..options.jobs.max(1)).map(|_| scope.spawn(run)).collect();
        workers.into_iter().try_for_each(|worker| worker.join().unwrap_or_else(|_| bail!("a worker thread panicked")))
    });
    // Hashes that cannot be saved are computed again next time.
    let _ = hashes.save();
    ended?;
    let failed_before = session.failed_before()?;
    let mut report = session.report.into_inner().unwrap_or_else(PoisonError::into_inner);
    report.failed_before = failed_before;
    Ok(report)
}

/// A unique worker name: host name, process id, a counter and a random number.
fn worker_name(host: &str) -> String {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    let host: String = host.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).take(40).collect();
    let nonce = rand::random::<u32>();
    format!("{host}-{}-{}-{nonce:08x}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed))
}

/// Removes the stop file of a full disk if there is space again.
fn resume_after_stop(folder: &DiskFolder) -> Result<()> {
    let Some(reason) = read_stop(folder)? else { return Ok(()) };
    let probe = folder.0.join(format!(".space-{}", std::process::id()));
    let has_space = std::fs::write(&probe, vec![0; 64 << 20]).is_ok();
    let _ = std::fs::remove_file(&probe);
    if !has_space {
        bail!("all workers have stopped: {reason}; free at least 64 MiB of disk space and start them again");
    }
    workdir::remove_file(&folder.0.join(STOP))
}

struct Session<'a> {
    plan: &'a ClusterPlan,
    folder: DiskFolder,
    pipeline: &'a Pipeline,
    options: &'a WorkerOptions,
    progress: &'a dyn Progress,
    hashes: &'a HashCache,
    begun: Instant,
    machine: &'a str,
    report: Mutex<WorkReport>,
    /// Whether a worker failed, so that all others stop too.
    is_broken: AtomicBool,
}

impl Session<'_> {
    fn run(&self, name: &str, first: Heartbeat) -> Result<()> {
        let heartbeat = HeartbeatFile { folder: &self.folder, name, content: Mutex::new(first), begun: self.begun };
        heartbeat.beat()?;
        let (stop, stopped) = channel::<()>();
        let ended = std::thread::scope(|scope| {
            let beating = &heartbeat;
            scope.spawn(move || {
                while stopped.recv_timeout(self.options.beat) == Err(RecvTimeoutError::Timeout) {
                    // A single failed beat does not make the worker count as dead.
                    let _ = beating.beat();
                }
            });
            let ended = self.work(name, &heartbeat);
            drop(stop);
            ended
        });
        // This also holds after an error, so that other workers may take over its unit at once.
        heartbeat.content().ended = true;
        ended.and(heartbeat.beat())
    }

    fn work(&self, name: &str, heartbeat: &HeartbeatFile) -> Result<()> {
        let options = ClaimOptions {
            worker: name.to_owned(),
            needs: self.plan.units.iter().map(|unit| unit.needs.clone()).collect(),
            order: self.order(),
            retries: self.options.retry,
        };
        let watch = BeatWatch::new(self.options.dead_after, self.machine);
        let mut claims = Claims::new(&self.folder, options, watch);
        while !self.should_stop()? {
            match claims.next(self.begun.elapsed())? {
                NextUnit::Claimed(claim) => self.work_on(name, claim, &mut claims, heartbeat)?,
                NextUnit::Wait(time) if self.options.wait => self.wait(time),
                NextUnit::Wait(_) | NextUnit::Blocked => break,
                NextUnit::AllEnded => {
                    self.report().all_ended = true;
                    break;
                }
            }
        }
        let blocked_unit = |(unit, file): (&usize, &String)| {
            format!("{}: {} was not written by a worker", self.plan.units[*unit], self.folder.0.join(file).display())
        };
        self.report().blocked.extend(claims.blocked().iter().map(blocked_unit));
        Ok(())
    }

    /// Units whose last claim ended with an error before this session; none while units have not ended.
    fn failed_before(&self) -> Result<Vec<String>> {
        let report = self.report();
        let mut failed = Vec::new();
        if !report.all_ended {
            return Ok(failed);
        }
        let states = read_states(&self.folder, self.plan.units.len())?;
        for unit in self.order() {
            let claim = Claim { unit, epoch: states[unit].epoch };
            let name = self.plan.units[unit].to_string();
            let is_new = report.failed.iter().any(|(failed, _)| *failed == name);
            if !is_new && claim.read_end(&self.folder)?.is_some_and(|end| end.error.is_some()) {
                failed.push(name);
            }
        }
        Ok(failed)
    }

    /// Waits for `time`, or until the program is asked to stop.
    fn wait(&self, time: Duration) {
        let begun = Instant::now();
        while let Some(left) = time.checked_sub(begun.elapsed()).filter(|_| !self.progress.is_to_stop()) {
            std::thread::sleep(left.min(Duration::from_millis(500)));
        }
    }

    /// Units that this worker may claim, in the order of the plan. All units of a video belong to one shard.
    fn order(&self) -> Vec<usize> {
        let mut videos: BTreeMap<(&str, &str), usize> = BTreeMap::new();
        let mut number = |unit: &usize| {
            let PlannedUnit { speaker, video, .. } = &self.plan.units[*unit];
            let next = videos.len();
            *videos.entry((speaker, video)).or_insert(next)
        };
        let is_in_shard = |unit: &usize| self.options.shard.is_none_or(|(i, n)| number(unit) % n == i);
        (0..self.plan.units.len()).filter(is_in_shard).collect()
    }

    fn should_stop(&self) -> Result<bool> {
        if let Some(reason) = read_stop(&self.folder)? {
            bail!("all workers stop: {reason}; free at least 64 MiB of disk space and start them again");
        }
        Ok(self.progress.is_to_stop() || self.is_broken.load(Ordering::Relaxed))
    }

    fn work_on(
        &self,
        name: &str,
        claim: Claim,
        claims: &mut Claims<DiskFolder>,
        heartbeat: &HeartbeatFile,
    ) -> Result<()> {
        let planned = &self.plan.units[claim.unit];
        let unit = planned.unit();
        heartbeat.content().unit = Some(planned.to_string());
        let begun = Instant::now();
        let check_claim = || match claims.is_mine(claim)? {
            true => planned.check_inputs(self.hashes),
            false => Err(ClaimLost(format!("{} was taken over by another worker", planned.video)).into()),
        };
        let run =
            |stages: &[StageName]| self.pipeline.run_video(stages, &unit, self.hashes, &check_claim, self.progress);
        let ended = match (planned.check_inputs(self.hashes), planned.share) {
            // Stages that are up to date do not call `check_claim`, so the inputs are also checked here.
            (Err(error), _) => vec![StageOutcome::Failed(Arc::new(error))],
            (Ok(()), UnitShare::AllStages) => run(&self.pipeline.config().settings.stages_of(&unit.speaker))?,
            (Ok(()), UnitShare::Extract) => run(&[StageName::Extract])?,
            (Ok(()), UnitShare::Parts { idx, of }) => {
                self.pipeline.run_parts(&unit, (idx, of), self.hashes, &check_claim, self.progress)?
            }
        };
        let failed = ended.iter().find_map(|outcome| match outcome {
            StageOutcome::Failed(error) => Some(error.clone()),
            _ => None,
        });
        heartbeat.content().unit = None;
        if let Some(error) = &failed {
            if error.is::<ClaimLost>() {
                self.report().claim_lost += 1;
                return Ok(());
            }
            if error.is::<NoSpace>() {
                self.folder.create(STOP, format!("{}: {error:#}", host_of(name)).as_bytes()).ok();
                return Err(anyhow!("{error:#}").context("the disk is full, all workers stop"));
            }
        }
        // A failure of a preparatory unit occurs again in the unit of the whole video and is reported there.
        let is_final = planned.share == UnitShare::AllStages;
        let error = failed.filter(|_| is_final).map(|error| format!("{error:#}"));
        let secs = begun.elapsed().as_secs_f64();
        let is_mine = claims.end(claim, &UnitEnd { worker: name.to_owned(), error: error.clone(), secs })?;
        let was_retried = claim.previous().map_or(Ok(None), |before| before.read_end(&self.folder))?.is_some();
        let mut report = self.report();
        report.reclaimed += usize::from(claim.epoch > 1 && !was_retried);
        report.claim_lost += usize::from(!is_mine);
        let mut content = heartbeat.content();
        match error {
            // The unit belongs to another worker now, which may have removed files that this one was writing.
            Some(_) if !is_mine => {}
            Some(error) => {
                content.n_failed += 1;
                report.failed.push((planned.to_string(), error));
            }
            None => {
                content.n_done += 1;
                content.media_secs += planned.media_secs().unwrap_or(0.0);
                report.done += 1;
                let is_up_to_date = is_final && ended.iter().all(|one| matches!(one, StageOutcome::Skipped(_)));
                report.up_to_date += usize::from(is_up_to_date);
            }
        }
        Ok(())
    }

    fn report(&self) -> MutexGuard<'_, WorkReport> {
        self.report.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn host_of(worker: &str) -> &str {
    worker.rsplitn(4, '-').last().unwrap_or(worker)
}

struct HeartbeatFile<'a> {
    folder: &'a DiskFolder,
    name: &'a str,
    content: Mutex<Heartbeat>,
    begun: Instant,
}

impl HeartbeatFile<'_> {
    fn beat(&self) -> Result<()> {
        let bytes = {
            let mut content = self.content();
            content.beat += 1;
            content.secs = self.begun.elapsed().as_secs_f64();
            serde_json::to_vec(&*content)?
        };
        self.folder.replace(&Heartbeat::name(self.name), &bytes)
    }

    fn content(&self) -> MutexGuard<'_, Heartbeat> {
        self.content.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
