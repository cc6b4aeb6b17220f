//! Units whose work is done in parts: the worker of such a unit shares its parts with workers that have run out of units.
//! Each part has a folder and a record of its own under `NAME.parts` beside the unit's folder, so that finished parts
//! survive a worker that is killed.

use super::attempt::{attempt, guarded};
use super::fingerprint::Fingerprint;
use super::overall::OverallProgress;
use super::record::Record;

use super::{Report, Stage, Unit, workdir};
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// End of the name of the folder with a unit's parts.
pub const PARTS: &str = ".parts";

/// Work on a unit that has parts.
#[derive(Clone)]
pub struct PartedWork<'a> {
    pub stage: &'a dyn Stage,
    pub unit: &'a Unit,
    pub n_parts: usize,
    pub fingerprint: Fingerprint,
    /// The unit's folder.
    pub folder: PathBuf,
    pub overall: &'a OverallProgress<'a>,
}

/// The folder of the parts of the unit in `folder`.
pub fn folder_of_parts(folder: &Path) -> PathBuf {
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    folder.with_file_name(format!("{name}{PARTS}"))
}

/// Removes the parts of the unit in `folder`, if there are any.
pub fn remove_parts(folder: &Path) -> Result<()> {
    let parts = folder_of_parts(folder);
    workdir::remove(&parts).with_context(|| format!("cannot remove {}", parts.display()))
}

impl PartedWork<'_> {
    /// Does a part, unless it is done.
    pub fn work_on(&self, part: usize) -> Result<()> {
        let folder = self.folder_of(part);
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

    fn folder_of(&self, part: usize) -> PathBuf {
        folder_of_parts(&self.folder).join(part.to_string())
    }
}

/// The workers of a run; `nn::cpu` lists the thread pools of the program.
pub struct WorkerPool<'a> {
    state: Mutex<PoolState<'a>>,
    changed: Condvar,
}

struct PoolState<'a> {
    /// Workers that still take units, and so may share parts.
    n_busy: usize,
    open: Vec<SharedUnit<'a>>,
    n_shared: usize,
}

/// A unit whose parts are in progress.
struct SharedUnit<'a> {
    number: usize,
    work: Arc<PartedWork<'a>>,
    next: usize,
    n_running: usize,
    failed: Option<anyhow::Error>,
}

impl<'a> WorkerPool<'a> {
    /// A pool of `n` workers that all take units; each calls `help` when there is no unit left.
    pub fn new(n: usize) -> Self {
        let state = PoolState { n_busy: n, open: Vec::new(), n_shared: 0 };
        Self { state: Mutex::new(state), changed: Condvar::new() }
    }

    /// Does all parts of a unit, together with who helps. Returns their folders in order. Errors: the first error of a
    /// part; no part is begun after it.
    pub fn work(&self, work: PartedWork<'a>) -> Result<Vec<PathBuf>> {
        let folders = (0..work.n_parts).map(|part| work.folder_of(part)).collect();
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
            let at = state.open.iter().position(|shared| shared.number == number).context("it was shared")?;
            if state.open[at].n_running == 0 {
                let ended = state.open.remove(at);
                return ended.failed.map_or(Ok(folders), Err);
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Does parts of other workers' units, until no worker takes units any more.
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

    /// Does one part, of the unit of that number or of any; `false`: there is none.
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
        let ended = guarded(|| work.work_on(part));
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

/// Counts a worker as one that takes units, until it is dropped.
pub struct BusyGuard<'c, 'a>(pub &'c WorkerPool<'a>);

impl Drop for BusyGuard<'_, '_> {
    fn drop(&mut self) {
        self.0.state().n_busy -= 1;
        self.0.changed.notify_all();
    }
}
