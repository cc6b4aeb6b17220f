//! Runs stages over units: units that are up to date are skipped, several workers process the others, and a failed
//! unit does not stop the run. Results do not depend on which worker processes a unit.

use super::attempt::{attempt, catch_panics};
use super::fingerprint::{Fingerprint, HashCache};
use super::overall::OverallProgress;
use super::parts::{BusyGuard, SplitWork, WorkerPool, remove_parts};
use super::progress::{Event, Progress};
use super::record::{DirtyReason, Failure, Record};
use super::workdir::FolderLock;
use super::{Report, Stage, Unit};
use anyhow::{Result, anyhow};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

/// State of a unit at a stage.
#[derive(Clone, Debug)]
pub enum State {
    UpToDate(Record),
    Stale(DirtyReason),
    Failed(String),
}

/// Error: the worker has lost its claim on the unit to another worker. This is not a failure of the unit.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{0}")]
pub struct ClaimLost(pub String);

/// Outcome of a run for a unit.
#[derive(Clone, Debug)]
pub enum StageOutcome {
    /// The unit was already up to date.
    Skipped(Report),
    Done(Report),
    Failed(Arc<anyhow::Error>),
}

/// Determines the state of `unit`. An unreadable input is a failure.
pub fn state(stage: &dyn Stage, unit: &Unit, work: &Path, hashes: &HashCache) -> State {
    let folder = unit.dir(&work.join(stage.name()));
    let now = match Fingerprint::now(stage, unit, hashes) {
        Ok(now) => now,
        Err(error) => return State::Failed(format!("{error:#}")),
    };
    let record = Record::read(&folder);
    let dirty = match &record {
        Some(record) => record.dirty(&now, stage.common_folder().unwrap_or(&folder)),
        None => Some(DirtyReason::NeverDone),
    };
    match (dirty, record) {
        (None, Some(record)) => State::UpToDate(record),
        (dirty, _) => match Failure::read(&folder) {
            Some(failure) if failure.fingerprint.as_ref() == Some(&now) => State::Failed(failure.error),
            _ => State::Stale(dirty.unwrap_or(DirtyReason::NeverDone)),
        },
    }
}

/// Runs `stage` for every unit on `jobs` workers (at least one). The outcomes are in the order of `units`.
pub fn run(
    stage: &dyn Stage,
    units: &[Unit],
    work: &Path,
    hashes: &HashCache,
    limits: (usize, bool),
    progress: &dyn Progress,
) -> Vec<StageOutcome> {
    run_stages(&[stage], units, work, hashes, limits, progress).into_iter().flatten().collect()
}

/// Runs `stages` in sequence for every unit on `jobs` workers (at least one). No stage waits until all units have
/// finished the stage before it, and the largest units start first, so that all workers finish together. Stages after a
/// failure are not run for that unit: its outcomes, one per stage, end with it. Units are in the order of `units`.
pub fn run_stages(
    stages: &[&dyn Stage],
    units: &[Unit],
    work: &Path,
    hashes: &HashCache,
    (jobs, force): (usize, bool),
    progress: &dyn Progress,
) -> Vec<Vec<StageOutcome>> {
    let next = AtomicUsize::new(0);
    let ended: Vec<Mutex<Vec<StageOutcome>>> = units.iter().map(|_| Mutex::new(Vec::new())).collect();
    let overall = OverallProgress::begin(stages, units, progress);
    let order = largest_first(units);
    let pool = WorkerPool::new(jobs.max(1));
    std::thread::scope(|scope| {
        for _ in 0..jobs.max(1) {
            scope.spawn(|| {
                let busy = BusyGuard(&pool);
                while let Some(&at) = order.get(next.fetch_add(1, Ordering::SeqCst)) {
                    for (idx, stage) in stages.iter().enumerate() {
                        let context = (work, hashes, force);
                        let answer = run_unit(*stage, &units[at], context, &pool, &overall);
                        report(&answer, *stage, &units[at], progress);
                        let has_failed = matches!(answer, StageOutcome::Failed(_));
                        if let Ok(mut answers) = ended[at].lock() {
                            answers.push(answer);
                        }
                        if has_failed {
                            overall.skip(&stages[idx + 1..], &units[at]);
                            break;
                        }
                    }
                    hashes.save_periodically();
                }
                drop(busy);
                pool.help();
            });
        }
    });
    let answers = ended.into_iter().map(|answers| answers.into_inner().unwrap_or_default());
    let completed = |mut answers: Vec<StageOutcome>| {
        if answers.len() < stages.len() && !matches!(answers.last(), Some(StageOutcome::Failed(_))) {
            answers.push(StageOutcome::Failed(Arc::new(anyhow!(
                "internal error: the worker thread ended without a result"
            ))));
        }
        answers
    };
    answers.map(completed).collect()
}

/// Runs share `idx` of `of` of the unit's unfinished parts. Does nothing if the unit has no parts or is up to date.
///
/// # Errors
/// An input cannot be read; the first error of a part.
pub fn run_parts(
    stage: &dyn Stage,
    unit: &Unit,
    (idx, of): (usize, usize),
    work: &Path,
    hashes: &HashCache,
    progress: &dyn Progress,
) -> Result<()> {
    if matches!(state(stage, unit, work, hashes), State::UpToDate(_)) {
        return Ok(());
    }
    let fingerprint = Fingerprint::now(stage, unit, hashes)?;
    let n_parts = stage.n_parts(unit)?;
    if n_parts < 2 {
        return Ok(());
    }
    let overall = OverallProgress::begin(&[stage], std::slice::from_ref(unit), progress);
    let folder = unit.dir(&work.join(stage.name()));
    let parts = SplitWork { stage, unit, n_parts, fingerprint, folder, overall: &overall };
    let bound = |idx: usize| idx * n_parts / of.max(1);
    (bound(idx)..bound(idx + 1)).try_for_each(|part| catch_panics(|| parts.work_on(part)))
}

/// Returns the indices of the units, ordered by descending size of the source file.
fn largest_first(units: &[Unit]) -> Vec<usize> {
    let bytes = |unit: &Unit| std::fs::metadata(&unit.source).map_or(0, |meta| meta.len());
    let mut order: Vec<usize> = (0..units.len()).collect();
    order.sort_by_cached_key(|at| std::cmp::Reverse(bytes(&units[*at])));
    order
}

fn report(answer: &StageOutcome, stage: &dyn Stage, unit: &Unit, progress: &dyn Progress) {
    let (stage, unit) = (stage.name(), unit.to_string());
    match answer {
        StageOutcome::Failed(error) => {
            progress.event(&Event::Failed { stage, unit: &unit, error: &format!("{error:#}") });
        }
        StageOutcome::Done(report) => progress.event(&Event::Done { stage, unit: &unit, line: &report.line }),
        StageOutcome::Skipped(_) => progress.event(&Event::UpToDate { stage, unit: &unit }),
    }
}

fn run_unit<'a>(
    stage: &'a dyn Stage,
    unit: &'a Unit,
    (work, hashes, force): (&Path, &HashCache, bool),
    pool: &WorkerPool<'a>,
    overall: &'a OverallProgress<'a>,
) -> StageOutcome {
    let folder = unit.dir(&work.join(stage.name()));
    let fingerprint = match catch_panics(|| Fingerprint::now(stage, unit, hashes)) {
        Ok(now) => now,
        Err(error) => {
            overall.skip(&[stage], unit);
            return failed(&folder, None, error);
        }
    };
    if !force
        && let Some(record) = Record::read(&folder)
        && record.dirty(&fingerprint, stage.common_folder().unwrap_or(&folder)).is_none()
    {
        overall.skip(&[stage], unit);
        // An earlier version may have left an outdated failure, and a killed program parts. If they cannot be removed,
        // the record is still valid.
        let _ = Failure::forget(&folder).and_then(|()| remove_parts(&folder));
        return StageOutcome::Skipped(Report { line: record.line, facts: record.facts });
    }
    let work = || {
        if force {
            remove_parts(&folder)?;
        }
        let n_parts = stage.n_parts(unit)?;
        if n_parts < 2 {
            let _lock = stage.needs_folder_lock().then(|| FolderLock::exclusive(&folder)).transpose()?;
            let progress = overall.of(stage, unit);
            return attempt(&folder, stage.common_folder(), &fingerprint, |out| stage.run(unit, out, &progress));
        }
        let key = fingerprint.clone();
        let parts = SplitWork { stage, unit, n_parts, fingerprint: key, folder: folder.clone(), overall };
        let parts = pool.work(parts)?;
        let report = attempt(&folder, None, &fingerprint, |out| stage.join(unit, &parts, out))?;
        // What cannot be removed now is removed by the next run.
        let _ = remove_parts(&folder);
        Ok(report)
    };
    match catch_panics(work) {
        Ok(report) => StageOutcome::Done(report),
        Err(error) => failed(&folder, Some(fingerprint), error),
    }
}

fn failed(folder: &Path, fingerprint: Option<Fingerprint>, error: anyhow::Error) -> StageOutcome {
    if !error.is::<ClaimLost>() {
        // The failure is reported in any case; if even this file cannot be written, the work folder itself is unusable.
        let _ = Failure { fingerprint, error: format!("{error:#}") }.write(folder);
    }
    StageOutcome::Failed(Arc::new(error))
}
