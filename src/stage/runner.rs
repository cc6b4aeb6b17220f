//! Runs stages over units: what is fresh is skipped, the rest is worked on by several workers, a failed unit does not
//! stop the others. What a unit makes does not depend on who made it.

use super::fingerprint::{Fingerprint, HashCache};
use super::overall::OverallProgress;
use super::progress::{Event, Progress};
use super::record::{DirtyReason, Failure, Output, Record};
use super::workdir::FolderLock;
use super::{Report, Stage, Unit, workdir};
use anyhow::{Context, Result, anyhow};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

/// Where a unit stands at a stage.
#[derive(Clone, Debug)]
pub enum State {
    Fresh(Record),
    Stale(DirtyReason),
    Failed(String),
}

/// How a unit came out of a run.
#[derive(Clone, Debug)]
pub enum StageOutcome {
    /// Fresh already.
    Skipped(Report),
    Done(Report),
    Failed(Arc<anyhow::Error>),
}

/// Where `unit` stands. An unreadable input is a failure.
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
        (None, Some(record)) => State::Fresh(record),
        (dirty, _) => match Failure::read(&folder) {
            Some(failure) if failure.fingerprint.as_ref() == Some(&now) => State::Failed(failure.error),
            _ => State::Stale(dirty.unwrap_or(DirtyReason::NeverDone)),
        },
    }
}

/// Runs `stage` for every unit on `jobs` workers (at least one); the answers stand in the order of `units`.
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

/// Runs `stages`, one after the other, for every unit on `jobs` workers (at least one). No unit waits for another at any
/// stage, and the largest begin first, so that the workers end together. A unit that fails goes no further: its answers,
/// one a stage, end with the failure. They stand in the order of `units`.
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
    std::thread::scope(|scope| {
        for _ in 0..jobs.clamp(1, units.len().max(1)) {
            scope.spawn(|| {
                while let Some(&at) = order.get(next.fetch_add(1, Ordering::SeqCst)) {
                    for (idx, stage) in stages.iter().enumerate() {
                        let answer = run_unit(*stage, &units[at], work, hashes, force, &overall);
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
                    hashes.save_now_and_then();
                }
            });
        }
    });
    let answers = ended.into_iter().map(|answers| answers.into_inner().unwrap_or_default());
    let whole = |mut answers: Vec<StageOutcome>| {
        if answers.len() < stages.len() && !matches!(answers.last(), Some(StageOutcome::Failed(_))) {
            answers.push(StageOutcome::Failed(Arc::new(anyhow!("the worker was lost"))));
        }
        answers
    };
    answers.map(whole).collect()
}

/// Indices of the units, those of large files first.
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
        StageOutcome::Skipped(_) => progress.event(&Event::Fresh { stage, unit: &unit }),
    }
}

fn run_unit(
    stage: &dyn Stage,
    unit: &Unit,
    work: &Path,
    hashes: &HashCache,
    force: bool,
    overall: &OverallProgress,
) -> StageOutcome {
    let folder = unit.dir(&work.join(stage.name()));
    let fingerprint = match guarded(|| Fingerprint::now(stage, unit, hashes)) {
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
        // An earlier program may have left one that is over; where it cannot be removed, the record still counts.
        let _ = Failure::forget(&folder);
        return StageOutcome::Skipped(Report { line: record.line, facts: record.facts });
    }
    match guarded(|| attempt(stage, unit, &folder, &fingerprint, &overall.of(stage, unit))) {
        Ok(report) => StageOutcome::Done(report),
        Err(error) => failed(&folder, Some(fingerprint), error),
    }
}

/// Runs a stage's code. A panic is a defect, but one video must not take the night's run with it.
pub fn guarded<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    let caught = catch_unwind(AssertUnwindSafe(work));
    caught.unwrap_or_else(|panic| Err(anyhow!("internal error: {}", panic_text(&*panic))))
}

fn attempt(
    stage: &dyn Stage,
    unit: &Unit,
    folder: &Path,
    fingerprint: &Fingerprint,
    progress: &dyn Progress,
) -> Result<Report> {
    let _lock = stage.is_read_long().then(|| FolderLock::exclusive(folder)).transpose()?;
    let attempt = workdir::attempt_folder(folder)?;
    let finish = || -> Result<Report> {
        let report = stage.run(unit, &attempt, progress).map_err(workdir::full_disk)?;
        let outputs = Output::list(&attempt)?;
        // An old record must not speak for new files, should this run be killed before it writes its own.
        Record::forget(folder)?;
        match stage.common_folder() {
            Some(common) => workdir::move_files(&attempt, common, outputs.iter().map(|output| output.file.as_str()))?,
            None => workdir::replace_folder(&attempt, folder)?,
        }
        let Report { line, facts } = report.clone();
        Record { fingerprint: fingerprint.clone(), outputs, line, facts }.write(folder).context("cannot record it")?;
        Ok(report)
    };
    let finished = finish();
    if finished.is_err() {
        let _ = std::fs::remove_dir_all(&attempt);
    }
    finished
}

fn failed(folder: &Path, fingerprint: Option<Fingerprint>, error: anyhow::Error) -> StageOutcome {
    // The failure is shown either way; where even this cannot be written the work folder itself is the trouble.
    let _ = Failure { fingerprint, error: format!("{error:#}") }.write(folder);
    StageOutcome::Failed(Arc::new(error))
}

fn panic_text(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned())).unwrap_or_else(|| "no message".to_owned())
}
