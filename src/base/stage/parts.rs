//! Units whose work is divided into parts: the worker of such a unit shares its parts with workers that have no units
//! left. Each part has its own folder and record in `NAME.parts` beside the unit's folder, so that finished parts
//! survive a worker that is killed.

use super::attempt::{attempt, catch_panics};
use super::fingerprint::Fingerprint;
use super::overall::OverallProgress;
use super::record::Record;

use super::{Report, Stage, Unit, workdir};
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Suffix of the folder with a unit's parts.
pub const PARTS: &str = ".parts";

/// Work on a unit that is divided into parts.
#[derive(Clone)]
pub struct SplitWork<'a> {
    pub stage: &'a dyn Stage,
    pub unit: &'a Unit,
    pub n_parts: usize,
    pub fingerprint: Fingerprint,
    /// Folder of the unit.
    pub folder: PathBuf,
    pub overall: &'a OverallProgress<'a>,
}

/// Returns the folder with the parts of the unit in `folder`.
pub fn parts_folder(folder: &Path) -> PathBuf {
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    folder.with_file_name(format!("{name}{PARTS}"))
}

/// Removes the parts of the unit in `folder`, if there are any.
pub fn remove_parts(folder: &Path) -> Result<()> {
    let parts = parts_folder(folder);
    workdir::remove(&parts).with_context(|| format!("cannot remove {}", parts.display()))
}

impl SplitWork<'_> {
    /// Runs a part, unless it is already done.
    pub fn work_on(&self, part: usize) -> Result<()> {
        let folder = self.part_folder(part);
        let progress = self.overall.of_part(self.stage, self.unit, part, self.n_parts);
        if Record::read(&folder).is_some_and(|record| record.dirty(&self.fingerprint, &folder).is_none()) {
            progress.skip();
            return Ok(());
        }
        let work = |out: &Path| {
            self.stage.run_part(self.unit, part, out, &progress)?;
            Ok(Report::default())
        };
        attempt(&folder, None, &self.fingerprint, work).map(drop)
    }

    fn part_folder(&self, part: usize) -> PathBuf {
        parts_folder(&self.folder).join(part.to_string())
    }
}

/// The workers of a run; `nn::cpu` lists the thread pools of the program.
pub struct WorkerPool<'a> {
    state: Mutex<PoolState<'a>>,
    changed: Condvar,
}

struct PoolState<'a> {
    /// Workers that may still take units, and thus may still share parts.
    n_busy: usize,
    open: Vec<SharedUnit<'a>>,
    n_shared: usize,
}

/// A unit with parts in progress.
struct SharedUnit<'a> {
    number: usize,
    work: Arc<SplitWork<'a>>,
    next: usize,
    n_running: usize,
    failed: Option<anyhow::Error>,
}

impl<'a> WorkerPool<'a> {
    /// Creates a pool of `n` workers that take units; each calls `help` when no unit is left.
    pub fn new(n: usize) -> Self {
        let state = PoolState { n_busy: n, open: Vec::new(), n_shared: 0 };
        Self { state: Mutex::new(state), changed: Condvar::new() }
    }

    /// Runs all parts of a unit, together with the workers that help. Returns their folders in order.
    ///
    /// # Errors
    /// The first error of a part; no further part is started after it.
    pub fn work(&self, work: SplitWork<'a>) -> Result<Vec<PathBuf>> {
        let folders = (0..work.n_parts).map(|part| work.part_folder(part)).collect();
        let number = {
            let mut state = self.state();
            state.n_shared += 1;
            let number = state.n_shared;
            state.open.push(SharedUnit { number, work: Arc::new(work), next: 0, n_running: 0, failed: None });
            number
        };
        self.changed.notify_all();
        while self.work_on_one(Some(number)) {}
        let mut state = self.state();
        loop {
            let at =
                state.open.iter().position(|shared| shared.number == number).context("the unit is not in progress")?;
            if state.open[at].n_running == 0 {
                let ended = state.open.remove(at);
                return ended.failed.map_or(Ok(folders), Err);
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Runs parts of other workers' units until no worker takes units any more.
    pub fn help(&self) {
        loop {
            while self.work_on_one(None) {}
            let state = self.state();
            if state.n_busy == 0 {
                return;
            }
            if !state.open.iter().any(SharedUnit::has_parts) {
                drop(self.changed.wait(state).unwrap_or_else(PoisonError::into_inner));
            }
        }
    }

    /// Runs one part, of the unit with this number or of any unit; returns `false` if there is none.
    fn work_on_one(&self, number: Option<usize>) -> bool {
        let taken = {
            let mut state = self.state();
            let fits =
                |shared: &&mut SharedUnit| shared.has_parts() && number.is_none_or(|number| shared.number == number);
            state.open.iter_mut().find(fits).map(|shared| {
                shared.next += 1;
                shared.n_running += 1;
                (shared.number, shared.work.clone(), shared.next - 1)
            })
        };
        let Some((number, work, part)) = taken else { return false };
        let ended = catch_panics(|| work.work_on(part));
        let mut state = self.state();
        if let Some(shared) = state.open.iter_mut().find(|shared| shared.number == number) {
            shared.n_running -= 1;
            shared.failed = shared.failed.take().or(ended.err());
        }
        drop(state);
        self.changed.notify_all();
        true
    }

    fn state(&self) -> MutexGuard<'_, PoolState<'a>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl SharedUnit<'_> {
    fn has_parts(&self) -> bool {
        self.failed.is_none() && self.next < self.work.n_parts
    }
}

/// Counts a worker as busy with units until it is dropped.
pub struct BusyGuard<'c, 'a>(pub &'c WorkerPool<'a>);

impl Drop for BusyGuard<'_, '_> {
    fn drop(&mut self) {
        self.0.state().n_busy -= 1;
        self.0.changed.notify_all();
    }
}
