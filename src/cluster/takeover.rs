//! Units in the hands of dead workers, as a worker finds them that has nothing else to do. Many may wait at once, so that
//! each looks seldom, and where many units are in hands, each at some of them: all together see all.

use super::claim_files::Claim;
use super::heartbeat::BeatWatch;
use super::shared_folder::SharedFolder;
use anyhow::Result;
use rand::{RngCore, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::time::Duration;

/// Most units of one look.
const MOST: usize = 32;

/// Looks for units whose worker is dead.
pub struct Takeover {
    watch: BeatWatch,
    /// Name of the worker that looks.
    worker: String,
    /// Which units this worker looks at among many: those that come first in an order of its own.
    order: u64,
    /// Earliest time of the next look.
    next_look: Duration,
    /// Who has a unit, by the claim.
    owners: BTreeMap<(usize, u32), String>,
    /// What the last look found.
    found: Vec<Claim>,
}

impl Takeover {
    /// For the worker of that name.
    pub fn new(watch: BeatWatch, worker: &str) -> Self {
        let order = ChaCha8Rng::from_seed(*blake3::hash(worker.as_bytes()).as_bytes()).next_u64();
        Self {
            watch,
            worker: worker.to_owned(),
            order,
            next_look: Duration::ZERO,
            owners: BTreeMap::new(),
            found: Vec::new(),
        }
    }

    /// Time between two looks: the dead are found a twelfth later than they are known to be dead.
    pub fn interval(&self) -> Duration {
        self.watch.dead_after() / 12
    }

    /// A unit of `claimed` that its worker has left without an end, at the time `now` of the watcher's clock.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub fn left_unit(
        &mut self,
        folder: &impl SharedFolder,
        mut claimed: Vec<Claim>,
        now: Duration,
    ) -> Result<Option<Claim>> {
        self.found.retain(|found| claimed.contains(found));
        if self.found.is_empty() && now >= self.next_look {
            self.next_look = now + self.interval();
            let key = |claim: &Claim| (claim.unit as u64 ^ self.order).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            claimed.sort_by_key(key);
            claimed.truncate(MOST);
            for claim in claimed {
                if self.is_left(folder, claim, now)? {
                    self.found.push(claim);
                }
            }
        }
        while let Some(claim) = self.found.pop() {
            // A listing may be older than the end.
            if claim.read_end(folder)?.is_none() {
                return Ok(Some(claim));
            }
        }
        Ok(None)
    }

    /// Whether the claim's worker is another one, and dead, or has ended without it.
    fn is_left(&mut self, folder: &impl SharedFolder, claim: Claim, now: Duration) -> Result<bool> {
        let owner = match self.owners.entry((claim.unit, claim.epoch)) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(unknown) => match claim.read_owner(folder)? {
                Some(owner) => unknown.insert(owner),
                None => return Ok(false),
            },
        };
        Ok(*owner != self.worker && self.watch.is_dead(folder, owner, now)?)
    }
}
