//! Assignment of units to workers by files created once and never changed. `NUMBER.claim.EPOCH` names the worker that
//! owns a unit; `NUMBER.end.EPOCH` records how it ended. A worker that takes a unit over from a dead worker, or retries
//! it after a failure, creates the claim of the next epoch: if two workers try, one succeeds, and no other claim is
//! affected. The claim of the highest epoch is valid; the owner of an older one discards its work (`Claims::is_mine`).

use super::heartbeat::BeatWatch;
use super::shared_folder::SharedFolder;
use anyhow::{Context, Result};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// Number of units whose files share a folder, so that listings stay short.
const UNITS_PER_FOLDER: usize = 1000;
/// Number of free units from which the next one is drawn at random, so that workers seldom try the same unit.
const FREE_CANDIDATES: usize = 16;
/// Maximum number of claims whose owners are checked at a time; the random choices of waiting workers cover all units.
const MAX_CHECKED: usize = 32;
/// First waiting time of a worker. It grows by half each time, up to the interval between two checks for dead workers.
const FIRST_WAIT: Duration = Duration::from_secs(2);

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Claim {
    pub unit: usize,
    /// Epoch of the claim: 1 for the first, one more each time the unit is taken over or retried.
    pub epoch: u32,
}

impl Claim {
    /// The claim of the next epoch, for a worker that takes the unit over.
    pub fn next_epoch(self) -> Self {
        Self { epoch: self.epoch + 1, ..self }
    }

    /// The claim of the previous epoch; `None` for the first.
    pub fn previous(self) -> Option<Self> {
        (self.epoch > 1).then(|| Self { epoch: self.epoch - 1, ..self })
    }

    /// Path of the file of a kind (`claim` or `end`) in the shared folder.
    fn file(self, kind: &str) -> String {
        let Self { unit, epoch } = self;
        format!("{}/{unit:06}.{kind}.{epoch:04}", folder_name(unit / UNITS_PER_FOLDER))
    }

    pub fn read_owner(self, folder: &impl SharedFolder) -> Result<ClaimOwner> {
        let file = self.file("claim");
        let Some(bytes) = folder.read(&file)? else { return Ok(ClaimOwner::NotVisible) };
        let claim = serde_json::from_slice(&bytes).map(|claim: ClaimFile| claim.worker);
        Ok(claim.map_or(ClaimOwner::Unreadable(file), ClaimOwner::Worker))
    }

    /// Reads how the unit ended under this claim; `None` if no end is visible yet. An unreadable file is a failure.
    pub fn read_end(self, folder: &impl SharedFolder) -> Result<Option<UnitEnd>> {
        let file = self.file("end");
        let damaged = || UnitEnd {
            worker: String::new(),
            error: Some(format!("unreadable end file {file}; retry the unit with --retry")),
            secs: 0.0,
        };
        Ok(folder.read(&file)?.map(|bytes| serde_json::from_slice(&bytes).unwrap_or_else(|_| damaged())))
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ClaimOwner {
    /// The file is not visible yet.
    NotVisible,
    Worker(String),
    /// The path (given here) is not a regular file or names no worker, so no worker created it as a claim.
    Unreadable(String),
}

#[derive(Serialize, Deserialize)]
struct ClaimFile {
    worker: String,
    unit: usize,
    epoch: u32,
}

/// Result of the work on a unit, the content of an end file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnitEnd {
    pub worker: String,
    /// Error message; `None` if the unit succeeded.
    pub error: Option<String>,
    /// Working time, seconds.
    pub secs: f64,
}

/// State of a unit as far as it is visible. States are ordered by time: the later one is larger.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct ClaimState {
    /// Epoch of the last claim; 0 if the unit is free.
    pub epoch: u32,
    pub has_ended: bool,
}

fn folder_name(folder: usize) -> String {
    format!("claims/{folder:04}")
}

/// Parses a file name of a claim folder (`/` at its end: not a regular file) into unit and state; `None` for any other
/// name. Anything named like a claim occupies the unit, but only a regular file can end it.
fn parse_name(name: &str) -> Option<(usize, ClaimState)> {
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

fn update_states(states: &mut [ClaimState], folder: &impl SharedFolder, number: usize) -> Result<()> {
    let units = number * UNITS_PER_FOLDER..((number + 1) * UNITS_PER_FOLDER).min(states.len());
    let files = folder.list(&folder_name(number))?;
    for (unit, state) in files.iter().filter_map(|name| parse_name(name)).filter(|(unit, _)| units.contains(unit)) {
        states[unit] = states[unit].max(state);
    }
    Ok(())
}

pub fn read_states(folder: &impl SharedFolder, n_units: usize) -> Result<Vec<ClaimState>> {
    let mut states = vec![ClaimState::default(); n_units];
    (0..n_units.div_ceil(UNITS_PER_FOLDER)).try_for_each(|number| update_states(&mut states, folder, number))?;
    Ok(states)
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NextUnit {
    Claimed(Claim),
    /// All remaining units are claimed by other workers or need units that have not ended. Ask again after this time.
    Wait(Duration),
    /// Every remaining unit is in `Claims::blocked` or needs a unit that is.
    Blocked,
    AllEnded,
}

#[derive(Clone, Debug)]
pub struct ClaimOptions {
    /// Name of the worker, unique in the plan.
    pub worker: String,
    /// For each unit of the plan, the units that must have ended before it starts.
    pub needs: Vec<Vec<usize>>,
    /// Units that this worker may claim, in order of preference.
    pub order: Vec<usize>,
    /// Whether to claim units again that had failed before this worker started.
    pub retries: bool,
}

pub struct Claims<'a, F> {
    folder: &'a F,
    options: ClaimOptions,
    watch: BeatWatch,
    states: Vec<ClaimState>,
    has_states: bool,
    /// Number of units at the start of `order` that are known to be claimed.
    n_passed: usize,
    /// Claims that may be taken over: those of failed units (`failed`) and those of dead workers (`orphaned`).
    failed: Vec<Claim>,
    orphaned: Vec<Claim>,
    /// Foreign files at the path of a claim or an end, by unit.
    blocked: BTreeMap<usize, String>,
    owners: BTreeMap<Claim, String>,
    next_check: Duration,
    /// Waiting time that `next` returned last; zero after a successful claim.
    last_wait: Duration,
    rng: ChaCha8Rng,
}

impl<'a, F: SharedFolder> Claims<'a, F> {
    pub fn new(folder: &'a F, options: ClaimOptions, watch: BeatWatch) -> Self {
        Self {
            folder,
            watch,
            states: vec![ClaimState::default(); options.needs.len()],
            has_states: false,
            n_passed: 0,
            failed: Vec::new(),
            orphaned: Vec::new(),
            blocked: BTreeMap::new(),
            owners: BTreeMap::new(),
            next_check: Duration::ZERO,
            last_wait: Duration::ZERO,
            rng: ChaCha8Rng::from_seed(*blake3::hash(options.worker.as_bytes()).as_bytes()),
            options,
        }
    }

    /// Claims the next unit; `now` is the time on this worker's own clock.
    pub fn next(&mut self, now: Duration) -> Result<NextUnit> {
        if let Some(claim) = self.claim_next(now)? {
            self.last_wait = Duration::ZERO;
            return Ok(NextUnit::Claimed(claim));
        }
        if self.options.order.iter().all(|unit| self.states[*unit].has_ended) {
            return Ok(NextUnit::AllEnded);
        }
        if self.is_stuck() {
            return Ok(NextUnit::Blocked);
        }
        let longest = self.watch.interval();
        self.last_wait = (self.last_wait * 3 / 2).clamp(FIRST_WAIT.min(longest), longest);
        Ok(NextUnit::Wait(self.last_wait))
    }

    /// Units that cannot be claimed or ended, each with the foreign file at the path of its claim or end.
    pub fn blocked(&self) -> &BTreeMap<usize, String> {
        &self.blocked
    }

    /// Whether every unit of the order that has not ended is blocked or needs a blocked one.
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

    /// Tries to claim a unit: a failed one first, then a free one, then one of a dead worker.
    fn claim_next(&mut self, now: Duration) -> Result<Option<Claim>> {
        if !self.has_states {
            self.refresh()?;
            self.has_states = true;
            self.failed = if self.options.retries { self.failed_claims()? } else { Vec::new() };
        }
        while let Some(failed) = self.failed.pop() {
            if self.try_claim(failed.next_epoch())? {
                return Ok(Some(failed.next_epoch()));
            }
        }
        if let Some(claim) = self.claim_free()? {
            return Ok(Some(claim));
        }
        self.refresh()?;
        // Units that ended in the meantime may have made others ready.
        if let Some(claim) = self.claim_free()? {
            return Ok(Some(claim));
        }
        self.check_workers(now)?;
        while let Some(orphan) = self.orphaned.pop() {
            let ClaimState { epoch, has_ended } = self.states[orphan.unit];
            // The listing may be older than the end file.
            let is_orphaned = epoch == orphan.epoch && !has_ended && orphan.read_end(self.folder)?.is_none();
            if is_orphaned && self.try_claim(orphan.next_epoch())? {
                return Ok(Some(orphan.next_epoch()));
            }
        }
        Ok(None)
    }

    /// Whether no other worker has taken the unit over. Call this just before publishing results.
    pub fn is_mine(&self, claim: Claim) -> Result<bool> {
        Ok(self.folder.read(&claim.next_epoch().file("claim"))?.is_none())
    }

    /// Records how the unit ended; `false` if another worker had taken the unit over.
    pub fn end(&mut self, claim: Claim, end: &UnitEnd) -> Result<bool> {
        let is_mine = self.is_mine(claim)?;
        let file = claim.file("end");
        if !self.folder.create(&file, &serde_json::to_vec(end)?)? {
            self.blocked.insert(claim.unit, file);
        }
        self.states[claim.unit] = ClaimState { epoch: claim.epoch, has_ended: true };
        Ok(is_mine)
    }

    /// Updates the states, except in folders where every unit has ended.
    fn refresh(&mut self) -> Result<()> {
        for number in 0..self.states.len().div_ceil(UNITS_PER_FOLDER) {
            let units = self.states[number * UNITS_PER_FOLDER..].iter().take(UNITS_PER_FOLDER);
            if !self.has_states || units.into_iter().any(|state| !state.has_ended) {
                update_states(&mut self.states, self.folder, number)?;
            }
        }
        Ok(())
    }

    fn claim_free(&mut self) -> Result<Option<Claim>> {
        loop {
            let is_free = |unit: &usize| self.states[*unit].epoch == 0;
            let order = &self.options.order;
            self.n_passed += order[self.n_passed..].iter().take_while(|unit| !is_free(unit)).count();
            let is_ready = |unit: &usize| self.options.needs[*unit].iter().all(|needed| self.states[*needed].has_ended);
            let free = order[self.n_passed..].iter().copied().filter(is_free).filter(is_ready);
            let next: Vec<usize> = free.take(FREE_CANDIDATES).collect();
            let Some(&unit) = next.choose(&mut self.rng) else { return Ok(None) };
            let claim = Claim { unit, epoch: 1 };
            if self.try_claim(claim)? {
                return Ok(Some(claim));
            }
            update_states(&mut self.states, self.folder, unit / UNITS_PER_FOLDER)?;
        }
    }

    /// The last claim of each claimed unit of the order, and whether the unit ended under it.
    fn last_claims(&self) -> impl Iterator<Item = (Claim, bool)> {
        let claim =
            |unit: &usize| (Claim { unit: *unit, epoch: self.states[*unit].epoch }, self.states[*unit].has_ended);
        self.options.order.iter().map(claim).filter(|(claim, _)| claim.epoch > 0)
    }

    /// Claims under which units of the order failed, in reverse order.
    fn failed_claims(&self) -> Result<Vec<Claim>> {
        let mut failed = Vec::new();
        for (claim, _) in self.last_claims().filter(|(_, has_ended)| *has_ended) {
            if claim.read_end(self.folder)?.is_some_and(|end| end.error.is_some()) {
                failed.push(claim);
            }
        }
        failed.reverse();
        Ok(failed)
    }

    /// Collects claims of dead workers and of workers that exited before the unit ended; `now`: this worker's clock.
    fn check_workers(&mut self, now: Duration) -> Result<()> {
        if !self.orphaned.is_empty() || now < self.next_check {
            return Ok(());
        }
        self.next_check = now + self.watch.interval();
        let mut claimed: Vec<Claim> =
            self.last_claims().filter(|(_, has_ended)| !has_ended).map(|(claim, _)| claim).collect();
        while claimed.len() > MAX_CHECKED {
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
                        // The foreign file was removed, so the unit is free again.
                        self.states[claim.unit].epoch -= 1;
                        self.n_passed = 0;
                    }
                    continue;
                }
            };
            if owner != self.options.worker && self.watch.is_dead(self.folder, &owner, now)? {
                self.orphaned.push(claim);
            }
            self.owners.insert(claim, owner);
        }
        Ok(())
    }

    fn try_claim(&mut self, claim: Claim) -> Result<bool> {
        let Claim { unit, epoch } = claim;
        let file = ClaimFile { worker: self.options.worker.clone(), unit, epoch };
        let is_claimed = self.folder.create(&claim.file("claim"), &serde_json::to_vec(&file)?);
        self.states[unit] = ClaimState { epoch, has_ended: false };
        is_claimed.with_context(|| format!("cannot claim unit {unit}"))
    }
}
