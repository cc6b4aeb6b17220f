//! A worker: it claims units of a plan, one after the other, and runs their stages, until every unit has ended or it is
//! asked to stop. Any number of workers on any machines share a plan.

use super::claims::{Claim, ClaimOptions, Claims, NextUnit, UnitEnd};
use super::heartbeat::{BeatWatch, Heartbeat, this_machine};
use super::plan::{ClusterPlan, PlannedUnit, UnitShare};
use super::shared_folder::{DiskFolder, SharedFolder};
use anyhow::{Context, Result, anyhow, bail};
use orator_base::stage::artifacts::StageName;
use orator_base::stage::fingerprint::HashCache;
use orator_base::stage::progress::Progress;
use orator_base::stage::runner::{ClaimLost, StageOutcome};
use orator_base::stage::workdir;
use orator_base::stage::workdir::NoSpace;
use orator_pipeline::Pipeline;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// File that stops every worker of a plan, with the reason in it.
pub const STOP: &str = "stop.txt";

/// How a worker works.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkerOptions {
    /// Units at a time, each under a claim of its own.
    pub jobs: usize,
    /// The share `i` of `n`, from 0, of an array without claims by chance; none: any unit.
    pub shard: Option<(usize, usize)>,
    /// Takes units again that had failed.
    pub retry: bool,
    /// Waits for the units in the hands of others, to take over those of the dead.
    pub wait: bool,
    /// Time between two beats.
    pub beat: Duration,
    /// Time without a beat after which another worker is dead.
    pub dead_after: Duration,
}

/// What workers of one process did.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct WorkReport {
    /// Units done, those that were fresh among them.
    pub done: usize,
    /// Of those, fresh at every stage before.
    pub fresh: usize,
    /// Units that failed, each with its error.
    pub failed: Vec<(String, String)>,
    /// Units taken over from dead workers.
    pub taken_over: usize,
    /// Units laid aside since others had taken them over.
    pub laid_aside: usize,
    /// Units that nobody can claim or end, each with what is in the place of its claim or end.
    pub blocked: BTreeSet<String>,
    /// Whether every unit of the plan, or of the share, has ended.
    pub all_ended: bool,
}

/// Why all workers are to stop; `None`: they are not.
pub(super) fn read_stop(folder: &DiskFolder) -> Result<Option<String>> {
    let said = |reason: Vec<u8>| match reason.is_empty() {
        true => format!("{} is there", folder.0.join(STOP).display()),
        false => String::from_utf8_lossy(&reason).into_owned(),
    };
    Ok(folder.read(STOP)?.map(said))
}

/// Works on the plan at `path`.
///
/// # Errors
/// Another program, configuration or models than the plan's; a folder that cannot be written; a full disk, of which
/// every worker of the plan is told.
pub fn work(
    plan: &ClusterPlan,
    path: &Path,
    pipeline: &Pipeline,
    options: &WorkerOptions,
    progress: &dyn Progress,
) -> Result<WorkReport> {
    let folder = DiskFolder(plan.folder(path));
    begin_after_stop(&folder)?;
    let dir = &pipeline.config().settings.work.dir;
    let _lock = workdir::lock_shared(dir).context("no work now")?;
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
        workers.into_iter().try_for_each(|worker| worker.join().unwrap_or_else(|_| bail!("a worker has panicked")))
    });
    // What cannot be kept is hashed again.
    let _ = hashes.save();
    ended?;
    Ok(session.report.into_inner().unwrap_or_else(PoisonError::into_inner))
}

/// A name that no other worker has: the machine's, the process and a number by chance.
fn worker_name(host: &str) -> String {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    let host: String = host.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).take(40).collect();
    let nonce = rand::random::<u32>();
    format!("{host}-{}-{}-{nonce:08x}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed))
}

/// Goes on where a full disk had stopped all workers, if there is room again.
fn begin_after_stop(folder: &DiskFolder) -> Result<()> {
    let Some(reason) = read_stop(folder)? else { return Ok(()) };
    let probe = folder.0.join(format!(".room-{}", std::process::id()));
    let has_room = std::fs::write(&probe, vec![0; 64 << 20]).is_ok();
    let _ = std::fs::remove_file(&probe);
    if !has_room {
        bail!("{reason}: all workers have stopped; make room and start them again");
    }
    workdir::remove_file(&folder.0.join(STOP))
}

/// Workers of one process on one plan.
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
    /// Whether a worker ended with an error, so that all end.
    is_broken: AtomicBool,
}

impl Session<'_> {
    /// One worker, with its heartbeat.
    fn run(&self, name: &str, first: Heartbeat) -> Result<()> {
        let heart = HeartbeatFile { folder: &self.folder, name, content: Mutex::new(first), begun: self.begun };
        heart.beat()?;
        let (stop, stopped) = channel::<()>();
        let ended = std::thread::scope(|scope| {
            let beats = &heart;
            scope.spawn(move || {
                while stopped.recv_timeout(self.options.beat) == Err(RecvTimeoutError::Timeout) {
                    // One beat that cannot be written is no death.
                    let _ = beats.beat();
                }
            });
            let ended = self.work(name, &heart);
            drop(stop);
            ended
        });
        // After an error too: other workers may take its unit at once.
        heart.content().ended = true;
        ended.and(heart.beat())
    }

    fn work(&self, name: &str, heart: &HeartbeatFile) -> Result<()> {
        let options = ClaimOptions {
            worker: name.to_owned(),
            needs: self.plan.units.iter().map(|unit| unit.needs.clone()).collect(),
            order: self.order(),
            retries: self.options.retry,
        };
        let watch = BeatWatch::new(self.options.dead_after, self.machine);
        let mut claims = Claims::new(&self.folder, options, watch);
        while !self.is_to_stop()? {
            match claims.next(self.begun.elapsed())? {
                NextUnit::Claimed(claim) => self.work_on(name, claim, &mut claims, heart)?,
                NextUnit::Wait(time) if self.options.wait => self.rest(time),
                NextUnit::Wait(_) | NextUnit::Blocked => break,
                NextUnit::AllEnded => {
                    self.report().all_ended = true;
                    break;
                }
            }
        }
        let in_the_way = |(unit, file): (&usize, &String)| {
            format!("{}: {} was not written by a worker", self.plan.units[*unit], self.folder.0.join(file).display())
        };
        self.report().blocked.extend(claims.blocked().iter().map(in_the_way));
        Ok(())
    }

    /// Waits so long, or until the program is asked to stop.
    fn rest(&self, time: Duration) {
        let begun = Instant::now();
        while let Some(left) = time.checked_sub(begun.elapsed()).filter(|_| !self.progress.is_to_stop()) {
            std::thread::sleep(left.min(Duration::from_millis(500)));
        }
    }

    /// The units this worker takes, in the order of the plan. All units of a video are of one share.
    fn order(&self) -> Vec<usize> {
        let mut videos: BTreeMap<(&str, &str), usize> = BTreeMap::new();
        let mut number = |unit: &usize| {
            let PlannedUnit { speaker, video, .. } = &self.plan.units[*unit];
            let next = videos.len();
            *videos.entry((speaker, video)).or_insert(next)
        };
        let of_shard = |unit: &usize| self.options.shard.is_none_or(|(i, n)| number(unit) % n == i);
        (0..self.plan.units.len()).filter(of_shard).collect()
    }

    /// Errors with what stopped all workers.
    fn is_to_stop(&self) -> Result<bool> {
        if let Some(reason) = read_stop(&self.folder)? {
            bail!("{reason}: all workers stop; make room and start them again");
        }
        Ok(self.progress.is_to_stop() || self.is_broken.load(Ordering::Relaxed))
    }

    fn work_on(&self, name: &str, claim: Claim, claims: &mut Claims<DiskFolder>, heart: &HeartbeatFile) -> Result<()> {
        let planned = &self.plan.units[claim.unit];
        let unit = planned.unit();
        heart.content().unit = Some(planned.to_string());
        let begun = Instant::now();
        let still_mine = || match claims.is_mine(claim)? {
            true => planned.check_inputs(self.hashes),
            false => Err(ClaimLost(format!("{} was taken over by another worker", planned.video)).into()),
        };
        let run =
            |stages: &[StageName]| self.pipeline.run_video(stages, &unit, self.hashes, &still_mine, self.progress);
        let ended = match (planned.check_inputs(self.hashes), planned.share) {
            // The stages that are up to date would ask nobody.
            (Err(error), _) => vec![StageOutcome::Failed(Arc::new(error))],
            (Ok(()), UnitShare::Whole) => run(&StageName::OF_VIDEOS)?,
            (Ok(()), UnitShare::Extract) => run(&[StageName::Extract])?,
            (Ok(()), UnitShare::Parts { idx, of }) => {
                self.pipeline.run_parts(&unit, (idx, of), self.hashes, &still_mine, self.progress)?
            }
        };
        let failed = ended.iter().find_map(|outcome| match outcome {
            StageOutcome::Failed(error) => Some(error.clone()),
            _ => None,
        });
        heart.content().unit = None;
        if let Some(error) = &failed {
            if error.is::<ClaimLost>() {
                self.report().laid_aside += 1;
                return Ok(());
            }
            if error.is::<NoSpace>() {
                self.folder.create(STOP, format!("{}: {error:#}", host_of(name)).as_bytes()).ok();
                return Err(anyhow!("{error:#}").context("the disk is full: all workers stop"));
            }
        }
        // What fails before the whole video's turn fails once more with it, and is told then.
        let is_whole = planned.share == UnitShare::Whole;
        let error = failed.filter(|_| is_whole).map(|error| format!("{error:#}"));
        let secs = begun.elapsed().as_secs_f64();
        let is_mine = claims.end(claim, &UnitEnd { worker: name.to_owned(), error: error.clone(), secs })?;
        let mut report = self.report();
        report.taken_over += usize::from(claim.epoch > 1);
        report.laid_aside += usize::from(!is_mine);
        let mut content = heart.content();
        match error {
            // The unit is another worker's now, which may have removed what this one was writing.
            Some(_) if !is_mine => {}
            Some(error) => {
                content.n_failed += 1;
                report.failed.push((planned.to_string(), error));
            }
            None => {
                content.n_done += 1;
                content.media_secs += planned.media_secs().unwrap_or(0.0);
                report.done += 1;
                let is_fresh = is_whole && ended.iter().all(|one| matches!(one, StageOutcome::Skipped(_)));
                report.fresh += usize::from(is_fresh);
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

/// The heartbeat of one worker.
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
