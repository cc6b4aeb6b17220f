//! Which worker does which unit, by files that are only ever created. `NUMBER.claim.EPOCH` names the worker that has a
//! unit, `NUMBER.end.EPOCH` how it ended. Who takes a unit over from a dead worker, or again after a failure, creates the
//! claim of the next epoch: of two that try, one succeeds, and nothing is ever taken away from a third. The claim of the
//! highest epoch counts; who has an older one lays its work aside (`Claims::is_mine`).

use super::claim_files::{Claim, ClaimFile, PER_FOLDER, UnitEnd, folder_name, parsed};
use super::heartbeat::BeatWatch;
use super::shared_folder::SharedFolder;
use super::takeover::Takeover;
use anyhow::{Context, Result};
use rand::{RngCore, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::Duration;

/// Free units from which the next one is taken.
const AHEAD: usize = 16;
/// A worker waits so long at first; then longer and longer, up to the time between two looks for the dead.
const FIRST_WAIT: Duration = Duration::from_secs(2);

/// Where a unit stands, as far as this worker knows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ClaimState {
    /// In nobody's hands.
    Free,
    /// In the hands of the claim of that epoch.
    Claimed(u32),
    /// Ended in that epoch.
    Ended(u32),
}

/// What there is to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NextUnit {
    /// This unit.
    Claimed(Claim),
    /// Nothing now: what is left is in the hands of others. Ask again after this time.
    Wait(Duration),
    /// Nothing: every unit has ended.
    AllEnded,
}

/// The claims of a plan, as one worker sees them.
pub struct Claims<'a, F> {
    folder: &'a F,
    worker: String,
    states: Vec<ClaimState>,
    /// Of each unit, those that must have ended before.
    needs: Vec<Vec<usize>>,
    /// Units this worker may take, in its order.
    order: Vec<usize>,
    /// Units at the start of the order that are known not to be free.
    n_passed: usize,
    takeover: Takeover,
    /// How long the worker last waited.
    waited: Duration,
    is_read: bool,
    /// Whether units that had failed before this worker came are taken again, and those left of them.
    retries: bool,
    failed: Vec<Claim>,
    chance: ChaCha8Rng,
}

impl<'a, F: SharedFolder> Claims<'a, F> {
    /// For the worker of that name, which takes the units of `order`, one after the other, none before those that it `needs`
    /// have ended. With `retries` it takes those that have failed before it came, too.
    pub fn new(
        folder: &'a F,
        worker: &str,
        needs: Vec<Vec<usize>>,
        order: Vec<usize>,
        watch: BeatWatch,
        retries: bool,
    ) -> Self {
        let states = vec![ClaimState::Free; needs.len()];
        let chance = ChaCha8Rng::from_seed(*blake3::hash(worker.as_bytes()).as_bytes());
        Self {
            folder,
            worker: worker.to_owned(),
            states,
            needs,
            order,
            n_passed: 0,
            takeover: Takeover::new(watch, worker),
            waited: Duration::ZERO,
            is_read: false,
            retries,
            failed: Vec::new(),
            chance,
        }
    }

    /// Claims the next unit; `now` is a time of this worker's own clock.
    ///
    /// # Errors
    /// A folder that cannot be read or written.
    pub fn next(&mut self, now: Duration) -> Result<NextUnit> {
        if let Some(claim) = self.claimed_next(now)? {
            self.waited = Duration::ZERO;
            return Ok(NextUnit::Claimed(claim));
        }
        if self.order.iter().all(|unit| self.has_ended(*unit)) {
            return Ok(NextUnit::AllEnded);
        }
        let most = self.takeover.interval();
        self.waited = (self.waited * 3 / 2).clamp(FIRST_WAIT.min(most), most);
        Ok(NextUnit::Wait(self.waited))
    }

    /// The unit that is claimed: one that had failed, else a free one, else one that a dead worker left.
    fn claimed_next(&mut self, now: Duration) -> Result<Option<Claim>> {
        if !self.is_read {
            self.read()?;
            self.is_read = true;
            if self.retries {
                self.failed = self.failed()?;
            }
        }
        while let Some(failed) = self.failed.pop() {
            if let Some(claim) = self.take_again(failed)? {
                return Ok(Some(claim));
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
        while let Some(left) = self.left_unit(now)? {
            if let Some(claim) = self.take_again(left)? {
                return Ok(Some(claim));
            }
        }
        Ok(None)
    }

    /// Whether nobody has taken the unit over. Just before work is put in its place.
    pub fn is_mine(&self, claim: Claim) -> Result<bool> {
        Ok(self.folder.read(&claim.later().file("claim"))?.is_none())
    }

    /// Says how the unit ended; `false`: somebody had taken it over.
    pub fn end(&mut self, claim: Claim, end: &UnitEnd) -> Result<bool> {
        let is_mine = self.is_mine(claim)?;
        self.folder.create(&claim.file("end"), &serde_json::to_vec(end)?)?;
        self.states[claim.unit] = ClaimState::Ended(claim.epoch);
        Ok(is_mine)
    }

    fn has_ended(&self, unit: usize) -> bool {
        matches!(self.states[unit], ClaimState::Ended(_))
    }

    /// Where every unit stands, as far as was seen.
    pub fn states(&self) -> &[ClaimState] {
        &self.states
    }

    /// Looks how far others are.
    ///
    /// # Errors
    /// A folder that cannot be listed.
    pub fn read(&mut self) -> Result<()> {
        (0..self.states.len().div_ceil(PER_FOLDER)).try_for_each(|folder| self.read_folder(folder))
    }

    fn read_folder(&mut self, folder: usize) -> Result<()> {
        let units = folder * PER_FOLDER..((folder + 1) * PER_FOLDER).min(self.states.len());
        if self.is_read && self.states[units.clone()].iter().all(|state| matches!(state, ClaimState::Ended(_))) {
            return Ok(());
        }
        for name in self.folder.list(&folder_name(folder))? {
            let Some((unit, is_end, epoch)) = parsed(&name).filter(|(unit, ..)| units.contains(unit)) else { continue };
            let state = &mut self.states[unit];
            let (known, had_ended) = match state {
                ClaimState::Free => (0, false),
                ClaimState::Claimed(epoch) => (*epoch, false),
                ClaimState::Ended(epoch) => (*epoch, true),
            };
            if epoch > known || (epoch == known && is_end && !had_ended) {
                *state = if is_end { ClaimState::Ended(epoch) } else { ClaimState::Claimed(epoch) };
            }
        }
        Ok(())
    }

    /// Takes one of the next free units; by chance which, so that workers seldom try the same.
    fn take_free(&mut self) -> Result<Option<Claim>> {
        loop {
            let is_free = |unit: &usize| self.states[*unit] == ClaimState::Free;
            self.n_passed += self.order[self.n_passed..].iter().take_while(|unit| !is_free(unit)).count();
            let is_ready = |unit: &usize| self.needs[*unit].iter().all(|needed| self.has_ended(*needed));
            let free = self.order[self.n_passed..].iter().copied().filter(is_free).filter(is_ready);
            let next: Vec<usize> = free.take(AHEAD).collect();
            let Some(&unit) = next.get(self.chance.next_u32() as usize % next.len().max(1)) else { return Ok(None) };
            let claim = Claim { unit, epoch: 1 };
            if self.take(claim)? {
                return Ok(Some(claim));
            }
            self.read_folder(unit / PER_FOLDER)?;
        }
    }

    /// Units of the order that have failed.
    fn failed(&self) -> Result<Vec<Claim>> {
        let mut failed = Vec::new();
        for &unit in self.order.iter().rev() {
            let ClaimState::Ended(epoch) = self.states[unit] else { continue };
            let claim = Claim { unit, epoch };
            if claim.read_end(self.folder)?.is_some_and(|end| end.error.is_some()) {
                failed.push(claim);
            }
        }
        Ok(failed)
    }

    /// A unit of the order that a dead worker left.
    fn left_unit(&mut self, now: Duration) -> Result<Option<Claim>> {
        let claimed = |unit: &usize| match self.states[*unit] {
            ClaimState::Claimed(epoch) => Some(Claim { unit: *unit, epoch }),
            _ => None,
        };
        let claimed = self.order.iter().filter_map(claimed).collect();
        self.takeover.left_unit(self.folder, claimed, now)
    }

    /// Takes a unit from the worker of an older claim.
    fn take_again(&mut self, older: Claim) -> Result<Option<Claim>> {
        let claim = older.later();
        Ok(self.take(claim)?.then_some(claim))
    }

    fn take(&mut self, claim: Claim) -> Result<bool> {
        let file = ClaimFile { worker: self.worker.clone(), unit: claim.unit, epoch: claim.epoch };
        let is_taken = self.folder.create(&claim.file("claim"), &serde_json::to_vec(&file)?);
        self.states[claim.unit] = ClaimState::Claimed(claim.epoch);
        is_taken.with_context(|| format!("cannot claim unit {}", claim.unit))
    }
}

#[cfg(test)]
mod tests {
    use super::super::heartbeat::Heartbeat;
    use super::super::shared_folder::delayed::DelayedFolder;
    use super::*;
    use rand::Rng;
    use std::cell::RefCell;
    use std::collections::BTreeMap;
    use std::rc::Rc;

    const DEAD_AFTER: Duration = Duration::from_secs(180);

    /// A worker of the simulation.
    struct Simulated<'a> {
        claims: Claims<'a, DelayedFolder>,
        name: String,
        /// Its clock is so far from the server's.
        clock: Duration,
        beat: u64,
        hands: Option<(Claim, Duration)>,
        is_dead: bool,
        /// Until then the worker neither works nor beats.
        paused_until: Duration,
    }

    fn folder(delay: Duration, seed: u64) -> DelayedFolder {
        DelayedFolder {
            files: Rc::default(),
            now: Rc::default(),
            delay,
            rng: Rc::new(RefCell::new(ChaCha8Rng::seed_from_u64(seed))),
            n_asked: Rc::default(),
        }
    }

    fn worker(folder: &DelayedFolder, n_units: usize, number: u64, retries: bool) -> Simulated<'_> {
        let name = format!("w{number}");
        let watch = BeatWatch::new(DEAD_AFTER, "");
        // Every fourth unit needs the three before it.
        let needs = (0..n_units).map(|unit| if unit % 4 == 3 { (unit - 3..unit).collect() } else { Vec::new() });
        Simulated {
            claims: Claims::new(folder, &name, needs.collect(), (0..n_units).collect(), watch, retries),
            name,
            clock: Duration::from_secs(97 * number),
            beat: 0,
            hands: None,
            is_dead: false,
            paused_until: Duration::ZERO,
        }
    }

    /// Eight workers on a folder that shows things up to a minute late, with clocks minutes apart. Some die, some stand still
    /// for longer than the dead are waited for; the dead are replaced. Every unit ends, and two have one unit at a time only
    /// where one of them died or stood still.
    #[test]
    fn every_unit_ends_whoever_dies() {
        for seed in 0..20 {
            let (mut rng, n_units) = (ChaCha8Rng::seed_from_u64(seed), 60);
            let folder = folder(Duration::from_secs(60), seed);
            let mut workers: Vec<Simulated> = (0..8).map(|number| worker(&folder, n_units, number, false)).collect();
            let (mut ended, mut n_troubles, mut n_twice) = (BTreeMap::new(), 0, 0);
            let (mut now, mut n_started) = (Duration::ZERO, 8);
            while ended.len() < n_units {
                now += Duration::from_secs(10);
                assert!(now < Duration::from_secs(200_000), "seed {seed}: {} of {n_units}", ended.len());
                *folder.now.borrow_mut() = now;
                for at in 0..workers.len() {
                    if workers[at].is_dead || now < workers[at].paused_until {
                        continue;
                    }
                    match rng.random_range(0..1000) {
                        0..4 => {
                            (workers[at].is_dead, n_troubles) = (true, n_troubles + 1);
                            let next = worker(&folder, n_units, n_started, false);
                            n_started += 1;
                            workers.push(next);
                            continue;
                        }
                        4..8 => {
                            let still = Duration::from_secs(rng.random_range(10..600));
                            (workers[at].paused_until, n_troubles) = (now + still, n_troubles + 1);
                            continue;
                        }
                        _ => {}
                    }
                    let one = &mut workers[at];
                    one.beat += 1;
                    let heartbeat = Heartbeat { beat: one.beat, ..Heartbeat::default() };
                    folder.replace(&Heartbeat::name(&one.name), &serde_json::to_vec(&heartbeat).unwrap()).unwrap();
                    match one.hands {
                        Some((claim, until)) if now >= until => {
                            one.hands = None;
                            let end = UnitEnd { worker: one.name.clone(), error: None, secs: 1.0 };
                            one.claims.end(claim, &end).unwrap();
                            n_twice += usize::from(ended.insert(claim.unit, claim.epoch).is_some());
                        }
                        Some(_) => {}
                        None => {
                            if let NextUnit::Claimed(claim) = one.claims.next(now + one.clock).unwrap() {
                                let needs = &one.claims.needs[claim.unit];
                                assert!(needs.iter().all(|needed| ended.contains_key(needed)), "seed {seed}");
                                one.hands = Some((claim, now + Duration::from_secs(rng.random_range(30..900))));
                            }
                        }
                    }
                }
            }
            assert!(n_twice <= n_troubles, "seed {seed}: {n_twice} units done twice, {n_troubles} troubles");
            assert!(n_troubles > 0);
        }
    }

    #[test]
    fn the_dead_are_waited_for_the_slow_keep_what_they_have_and_the_failed_are_retried_once() {
        let folder = folder(Duration::ZERO, 1);
        let [mut a, mut b] = [0, 1].map(|number| worker(&folder, 2, number, false).claims);
        let secs = Duration::from_secs;
        let NextUnit::Claimed(first) = a.next(secs(0)).unwrap() else { panic!("nobody has a unit") };
        let second = Claim { unit: 1 - first.unit, epoch: 1 };
        assert_eq!(b.next(secs(0)).unwrap(), NextUnit::Claimed(second));
        let beat = |beat| serde_json::to_vec(&Heartbeat { beat, ..Heartbeat::default() }).unwrap();
        for at in 1..=30 {
            // A slow one beats on.
            folder.replace("workers/w0.json", &beat(at)).unwrap();
            assert!(matches!(b.next(secs(60 * at)).unwrap(), NextUnit::Wait(_)));
        }
        assert!(a.is_mine(first).unwrap());
        // It waits longer and longer, up to a twelfth of the time after which a worker is dead.
        assert_eq!(b.next(secs(60 * 30 + 179)).unwrap(), NextUnit::Wait(secs(15)));
        let stolen = Claim { epoch: 2, ..first };
        assert_eq!(b.next(secs(60 * 30 + 179 + 15)).unwrap(), NextUnit::Claimed(stolen));
        assert!(!a.is_mine(first).unwrap() && b.is_mine(stolen).unwrap());
        let end = |error: Option<&str>| UnitEnd { worker: "w".to_owned(), error: error.map(str::to_owned), secs: 1.0 };
        assert!(!a.end(first, &end(None)).unwrap(), "it was taken over");
        assert!(b.end(stolen, &end(Some("no picture"))).unwrap());
        assert!(b.end(second, &end(None)).unwrap());
        assert_eq!(a.next(secs(0)).unwrap(), NextUnit::AllEnded);
        let mut again = worker(&folder, 2, 7, true).claims;
        let third = Claim { epoch: 3, ..first };
        assert_eq!(again.next(secs(0)).unwrap(), NextUnit::Claimed(third));
        assert!(again.end(third, &end(Some("no picture"))).unwrap());
        assert_eq!(again.next(secs(1)).unwrap(), NextUnit::AllEnded);
    }
}
