//! Which worker does which unit, by files that are only ever created. `NUMBER.claim.EPOCH` names the worker that has a
//! unit, `NUMBER.end.EPOCH` how it ended. A worker that takes a unit over from a dead one, or again after a failure, creates
//! the claim of the next epoch: of two that try, one succeeds, and nothing is ever taken away from a third. The claim of the
//! highest epoch counts; the owner of an older one discards its work (`Claims::is_mine`).

use super::heartbeat::BeatWatch;
use super::shared_folder::SharedFolder;
use anyhow::{Context, Result};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// Units whose files share a folder: a listing stays short.
const PER_FOLDER: usize = 1000;
/// Free units from which the next one is drawn, so that workers seldom try the same.
const AHEAD: usize = 16;
/// Most units whose workers are checked at a time; all waiting workers together see all units.
const MOST_CHECKED: usize = 32;
/// A worker waits so long at first; then longer and longer, up to the time between two checks for dead workers.
const FIRST_WAIT: Duration = Duration::from_secs(2);

/// A unit that a worker has claimed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Claim {
    /// Its number in the plan.
    pub unit: usize,
    /// 1; more where other workers had it before.
    pub epoch: u32,
}

impl Claim {
    /// The claim of the worker that takes the unit over.
    pub fn later(self) -> Self {
        Self { epoch: self.epoch + 1, ..self }
    }

    /// Its file of a kind: `claim` or `end`.
    fn file(self, kind: &str) -> String {
        let Self { unit, epoch } = self;
        format!("{}/{unit:06}.{kind}.{epoch:04}", folder_name(unit / PER_FOLDER))
    }

    /// The worker that made it.
    pub fn read_owner(self, folder: &impl SharedFolder) -> Result<ClaimOwner> {
        let file = self.file("claim");
        let Some(bytes) = folder.read(&file)? else { return Ok(ClaimOwner::NotVisible) };
        let claim = serde_json::from_slice(&bytes).map(|claim: ClaimFile| claim.worker);
        Ok(claim.map_or(ClaimOwner::Unreadable(file), ClaimOwner::Worker))
    }

    /// How the unit ended under it; `None`: it has not, as far as is visible. A file that says nothing is a failure.
    pub fn read_end(self, folder: &impl SharedFolder) -> Result<Option<UnitEnd>> {
        let file = self.file("end");
        let damaged =
            || UnitEnd { worker: String::new(), error: Some(format!("{file} does not say how it ended")), secs: 0.0 };
        Ok(folder.read(&file)?.map(|bytes| serde_json::from_slice(&bytes).unwrap_or_else(|_| damaged())))
    }
}

/// Whom the file of a claim names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ClaimOwner {
    /// The file is not visible yet.
    NotVisible,
    Worker(String),
    /// What has the name of the file, given here, is none or names no worker; nobody made it as a claim.
    Unreadable(String),
}

/// Content of a claim's file.
#[derive(Serialize, Deserialize)]
struct ClaimFile {
    worker: String,
    unit: usize,
    epoch: u32,
}

/// How a unit ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnitEnd {
    /// The worker that had it.
    pub worker: String,
    /// Why it failed; none: it is done.
    pub error: Option<String>,
    /// Seconds of work.
    pub secs: f64,
}

/// State of a unit as far as is visible; the later of two is the larger.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct ClaimState {
    /// Of the last claim; 0: the unit is free.
    pub epoch: u32,
    /// Whether the unit ended under that claim.
    pub has_ended: bool,
}

fn folder_name(folder: usize) -> String {
    format!("claims/{folder:04}")
}

/// Unit and state by the name of a file in its folder; none: another file. A unit is held by whatever has the name of a
/// claim, but has not ended by what is no file.
fn parsed(name: &str) -> Option<(usize, ClaimState)> {
    let file = name.strip_suffix('/');
    if file.is_some_and(|name| name.contains(".end.")) {
        return None;
    }
    let mut parts = file.unwrap_or(name).split('.');
    let (unit, kind, epoch) = (parts.next()?, parts.next()?, parts.next()?);
    let is_known = matches!(kind, "claim" | "end") && parts.next().is_none();
    let state = ClaimState { epoch: epoch.parse().ok()?, has_ended: kind == "end" };
    Some((unit.parse().ok()?, state)).filter(|_| is_known)
}

/// Updates the states of the units whose files lie in folder `number`.
fn update(states: &mut [ClaimState], folder: &impl SharedFolder, number: usize) -> Result<()> {
    let units = number * PER_FOLDER..((number + 1) * PER_FOLDER).min(states.len());
    let files = folder.list(&folder_name(number))?;
    for (unit, state) in files.iter().filter_map(|name| parsed(name)).filter(|(unit, _)| units.contains(unit)) {
        states[unit] = states[unit].max(state);
    }
    Ok(())
}

/// States of the `n_units` units of a plan.
pub fn read_states(folder: &impl SharedFolder, n_units: usize) -> Result<Vec<ClaimState>> {
    let mut states = vec![ClaimState::default(); n_units];
    (0..n_units.div_ceil(PER_FOLDER)).try_for_each(|number| update(&mut states, folder, number))?;
    Ok(states)
}

/// What there is to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NextUnit {
    /// This unit.
    Claimed(Claim),
    /// Nothing now: other workers have what is left. Ask again after this time.
    Wait(Duration),
    /// Nothing: all that is left is `Claims::blocked`, or needs what is.
    Blocked,
    /// Nothing: every unit has ended.
    AllEnded,
}

/// Which units a worker may claim.
#[derive(Clone, Debug)]
pub struct ClaimOptions {
    /// Unique name of the worker.
    pub worker: String,
    /// For each unit of the plan, those that must have ended before.
    pub needs: Vec<Vec<usize>>,
    /// Units this worker may take, in its order.
    pub order: Vec<usize>,
    /// Whether units that had failed before this worker started are taken again.
    pub retries: bool,
}

/// The claims of a plan, as one worker sees them.
pub struct Claims<'a, F> {
    folder: &'a F,
    options: ClaimOptions,
    watch: BeatWatch,
    states: Vec<ClaimState>,
    is_read: bool,
    /// Units at the start of the order that are known not to be free.
    n_passed: usize,
    /// Claims that may be taken over: of failed units, and of dead workers.
    failed: Vec<Claim>,
    left: Vec<Claim>,
    /// Files in the place of claims and ends, by unit.
    blocked: BTreeMap<usize, String>,
    /// Known owners of claims.
    owners: BTreeMap<Claim, String>,
    /// Earliest time of the next check for dead workers.
    next_check: Duration,
    /// How long the worker last waited.
    waited: Duration,
    rng: ChaCha8Rng,
}

impl<'a, F: SharedFolder> Claims<'a, F> {
    pub fn new(folder: &'a F, options: ClaimOptions, watch: BeatWatch) -> Self {
        Self {
            folder,
            watch,
            states: vec![ClaimState::default(); options.needs.len()],
            is_read: false,
            n_passed: 0,
            failed: Vec::new(),
            left: Vec::new(),
            blocked: BTreeMap::new(),
            owners: BTreeMap::new(),
            next_check: Duration::ZERO,
            waited: Duration::ZERO,
            rng: ChaCha8Rng::from_seed(*blake3::hash(options.worker.as_bytes()).as_bytes()),
            options,
        }
    }

    /// Claims the next unit; `now` is a time of this worker's own clock.
    pub fn next(&mut self, now: Duration) -> Result<NextUnit> {
        if let Some(claim) = self.claimed_next(now)? {
            self.waited = Duration::ZERO;
            return Ok(NextUnit::Claimed(claim));
        }
        if self.options.order.iter().all(|unit| self.states[*unit].has_ended) {
            return Ok(NextUnit::AllEnded);
        }
        if self.is_stuck() {
            return Ok(NextUnit::Blocked);
        }
        let most = self.watch.interval();
        self.waited = (self.waited * 3 / 2).clamp(FIRST_WAIT.min(most), most);
        Ok(NextUnit::Wait(self.waited))
    }

    /// Units, each with the file in the place of its claim or end that no worker wrote.
    pub fn blocked(&self) -> &BTreeMap<usize, String> {
        &self.blocked
    }

    /// Whether every unit of the order that has not ended is blocked, or needs one that is.
    fn is_stuck(&self) -> bool {
        let blocked = self.blocked.keys().copied();
        let mut stuck: BTreeSet<usize> = blocked.filter(|unit| !self.states[*unit].has_ended).collect();
        let left = || self.options.order.iter().filter(|unit| !self.states[**unit].has_ended);
        loop {
            let needs_one = |unit: &&usize| self.options.needs[**unit].iter().any(|needed| stuck.contains(needed));
            let more: Vec<usize> = left().filter(|unit| !stuck.contains(unit)).filter(needs_one).copied().collect();
            if more.is_empty() {
                return left().all(|unit| stuck.contains(unit));
            }
            stuck.extend(more);
        }
    }

    /// The unit that is claimed: one that had failed, else a free one, else one that a dead worker left.
    fn claimed_next(&mut self, now: Duration) -> Result<Option<Claim>> {
        if !self.is_read {
            self.read()?;
            self.is_read = true;
            self.failed = if self.options.retries { self.failed()? } else { Vec::new() };
        }
        while let Some(failed) = self.failed.pop() {
            if self.take(failed.later())? {
                return Ok(Some(failed.later()));
            }
        }
        if let Some(claim) = self.take_free()? {
            return Ok(Some(claim));
        }
        self.read()?;
        // What has ended meanwhile may have been waited for.
        if let Some(claim) = self.take_free()? {
            return Ok(Some(claim));
        }
        self.check_workers(now)?;
        while let Some(left) = self.left.pop() {
            let ClaimState { epoch, has_ended } = self.states[left.unit];
            // A listing may be older than the end.
            let is_left = epoch == left.epoch && !has_ended && left.read_end(self.folder)?.is_none();
            if is_left && self.take(left.later())? {
                return Ok(Some(left.later()));
            }
        }
        Ok(None)
    }

    /// Whether no other worker has taken the unit over. To be called just before work is published.
    pub fn is_mine(&self, claim: Claim) -> Result<bool> {
        Ok(self.folder.read(&claim.later().file("claim"))?.is_none())
    }

    /// Records how the unit ended; `false`: another worker had taken it over.
    pub fn end(&mut self, claim: Claim, end: &UnitEnd) -> Result<bool> {
        let is_mine = self.is_mine(claim)?;
        let file = claim.file("end");
        if !self.folder.create(&file, &serde_json::to_vec(end)?)? {
            self.blocked.insert(claim.unit, file);
        }
        self.states[claim.unit] = ClaimState { epoch: claim.epoch, has_ended: true };
        Ok(is_mine)
    }

    /// Updates the states, except those of folders in which every unit has ended.
    fn read(&mut self) -> Result<()> {
        for number in 0..self.states.len().div_ceil(PER_FOLDER) {
            let units = self.states[number * PER_FOLDER..].iter().take(PER_FOLDER);
            if !self.is_read || units.into_iter().any(|state| !state.has_ended) {
                update(&mut self.states, self.folder, number)?;
            }
        }
        Ok(())
    }

    /// Takes one of the next free units.
    fn take_free(&mut self) -> Result<Option<Claim>> {
        loop {
            let is_free = |unit: &usize| self.states[*unit].epoch == 0;
            let order = &self.options.order;
            self.n_passed += order[self.n_passed..].iter().take_while(|unit| !is_free(unit)).count();
            let is_ready = |unit: &usize| self.options.needs[*unit].iter().all(|needed| self.states[*needed].has_ended);
            let free = order[self.n_passed..].iter().copied().filter(is_free).filter(is_ready);
            let next: Vec<usize> = free.take(AHEAD).collect();
            let Some(&unit) = next.choose(&mut self.rng) else { return Ok(None) };
            let claim = Claim { unit, epoch: 1 };
            if self.take(claim)? {
                return Ok(Some(claim));
            }
            update(&mut self.states, self.folder, unit / PER_FOLDER)?;
        }
    }

    /// Last claims of the units of the order, with whether they ended under it.
    fn last_claims(&self) -> impl Iterator<Item = (Claim, bool)> {
        let claim =
            |unit: &usize| (Claim { unit: *unit, epoch: self.states[*unit].epoch }, self.states[*unit].has_ended);
        self.options.order.iter().map(claim).filter(|(claim, _)| claim.epoch > 0)
    }

    /// Claims under which units of the order failed, the first one last.
    fn failed(&self) -> Result<Vec<Claim>> {
        let mut failed = Vec::new();
        for (claim, _) in self.last_claims().filter(|(_, has_ended)| *has_ended) {
            if claim.read_end(self.folder)?.is_some_and(|end| end.error.is_some()) {
                failed.push(claim);
            }
        }
        failed.reverse();
        Ok(failed)
    }

    /// Collects claims whose workers are dead, or have ended without them, at the time `now` of this worker's clock.
    fn check_workers(&mut self, now: Duration) -> Result<()> {
        if !self.left.is_empty() || now < self.next_check {
            return Ok(());
        }
        self.next_check = now + self.watch.interval();
        let mut claimed: Vec<Claim> =
            self.last_claims().filter(|(_, has_ended)| !has_ended).map(|(claim, _)| claim).collect();
        while claimed.len() > MOST_CHECKED {
            claimed.swap_remove(self.rng.random_range(0..claimed.len()));
        }
        for claim in claimed {
            let was_blocked = self.blocked.remove(&claim.unit).is_some();
            let known = self.owners.get(&claim).cloned().map(ClaimOwner::Worker);
            let owner = match known.map_or_else(|| claim.read_owner(self.folder), Ok)? {
                ClaimOwner::Worker(owner) => owner,
                ClaimOwner::Unreadable(file) => {
                    self.blocked.insert(claim.unit, file);
                    continue;
                }
                ClaimOwner::NotVisible => {
                    if was_blocked {
                        // What was in the way is removed.
                        self.states[claim.unit].epoch -= 1;
                        self.n_passed = 0;
                    }
                    continue;
                }
            };
            if owner != self.options.worker && self.watch.is_dead(self.folder, &owner, now)? {
                self.left.push(claim);
            }
            self.owners.insert(claim, owner);
        }
        Ok(())
    }

    fn take(&mut self, claim: Claim) -> Result<bool> {
        let Claim { unit, epoch } = claim;
        let file = ClaimFile { worker: self.options.worker.clone(), unit, epoch };
        let is_taken = self.folder.create(&claim.file("claim"), &serde_json::to_vec(&file)?);
        self.states[unit] = ClaimState { epoch, has_ended: false };
        is_taken.with_context(|| format!("cannot claim unit {unit}"))
    }
}
