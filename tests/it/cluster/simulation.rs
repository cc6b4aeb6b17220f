//! Simulation of workers that claim units in a folder that shows changes late, as a network file system does.

use anyhow::Result;
use orator_cluster::claims::{Claim, ClaimOptions, Claims, NextUnit, UnitEnd};
use orator_cluster::heartbeat::{BeatWatch, DEAD_AFTER, Heartbeat};
use orator_cluster::shared_folder::{DiskFolder, SharedFolder};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::time::Duration;

/// Files on the server, each with its versions and their times.
type Files = BTreeMap<String, Vec<(Duration, Vec<u8>)>>;

/// A machine's view of the server: reads and listings may be up to `delay` old.
struct DelayedFolder {
    files: RefCell<Files>,
    now: Cell<Duration>,
    delay: Duration,
    rng: RefCell<ChaCha8Rng>,
}

impl DelayedFolder {
    fn visible_time(&self) -> Duration {
        let late = self.rng.borrow_mut().random_range(0.0..=1.0);
        self.now.get().saturating_sub(self.delay.mul_f64(late))
    }
}

impl SharedFolder for DelayedFolder {
    fn create(&self, name: &str, bytes: &[u8]) -> Result<bool> {
        let mut files = self.files.borrow_mut();
        if let Some(versions) = files.get(name) {
            return Ok(versions[0].1 == bytes);
        }
        files.insert(name.to_owned(), vec![(self.now.get(), bytes.to_vec())]);
        Ok(true)
    }

    fn read(&self, name: &str) -> Result<Option<Vec<u8>>> {
        let at = self.visible_time();
        let files = self.files.borrow();
        let version = files.get(name).and_then(|versions| versions.iter().rev().find(|(time, _)| *time <= at));
        Ok(version.map(|(_, bytes)| bytes.clone()))
    }

    fn list(&self, folder: &str) -> Result<Vec<String>> {
        let at = self.visible_time();
        let files = self.files.borrow();
        let visible = files.iter().filter(|(_, versions)| versions[0].0 <= at);
        Ok(visible.filter_map(|(name, _)| Some(name.strip_prefix(folder)?.strip_prefix('/')?.to_owned())).collect())
    }

    fn replace(&self, name: &str, bytes: &[u8]) -> Result<()> {
        let version = (self.now.get(), bytes.to_vec());
        self.files.borrow_mut().entry(name.to_owned()).or_default().push(version);
        Ok(())
    }
}

struct Simulated<'a> {
    claims: Claims<'a, DelayedFolder>,
    name: String,
    /// Offset of its clock from the server's.
    clock: Duration,
    beat: u64,
    current: Option<(Claim, Duration)>,
    is_dead: bool,
    /// Until this time the worker neither works nor beats.
    paused_until: Duration,
}

fn folder(delay: Duration, seed: u64) -> DelayedFolder {
    let rng = RefCell::new(ChaCha8Rng::seed_from_u64(seed));
    DelayedFolder { files: RefCell::default(), now: Cell::default(), delay, rng }
}

fn worker(folder: &DelayedFolder, n_units: usize, number: u64, retries: bool) -> Simulated<'_> {
    let name = format!("w{number}");
    let watch = BeatWatch::new(DEAD_AFTER, "");
    // Every fourth unit needs the three units before it.
    let needs = (0..n_units).map(|unit| if unit % 4 == 3 { (unit - 3..unit).collect() } else { Vec::new() });
    let (needs, order) = (needs.collect(), (0..n_units).collect());
    Simulated {
        claims: Claims::new(folder, ClaimOptions { worker: name.clone(), needs, order, retries }, watch),
        name,
        clock: Duration::from_secs(97 * number),
        beat: 0,
        current: None,
        is_dead: false,
        paused_until: Duration::ZERO,
    }
}

/// Eight workers on a folder that shows changes up to a minute late, with clocks minutes apart. Some die and are
/// replaced; some pause for longer than the timeout for dead workers. Every unit ends, and a unit ends twice only if a
/// worker died or paused.
#[test]
fn every_unit_ends_although_workers_die() {
    for seed in 0..20 {
        let (mut rng, n_units) = (ChaCha8Rng::seed_from_u64(seed), 60);
        let folder = folder(Duration::from_secs(60), seed);
        let mut workers: Vec<Simulated> = (0..8).map(|number| worker(&folder, n_units, number, false)).collect();
        let (mut ended, mut n_faults, mut n_twice) = (BTreeMap::new(), 0, 0);
        let (mut now, mut n_started) = (Duration::ZERO, 8);
        while ended.len() < n_units {
            now += Duration::from_secs(10);
            assert!(now < Duration::from_secs(200_000), "seed {seed}: {} of {n_units}", ended.len());
            folder.now.set(now);
            for at in 0..workers.len() {
                if workers[at].is_dead || now < workers[at].paused_until {
                    continue;
                }
                match rng.random_range(0..1000) {
                    0..4 => {
                        (workers[at].is_dead, n_faults) = (true, n_faults + 1);
                        let next = worker(&folder, n_units, n_started, false);
                        n_started += 1;
                        workers.push(next);
                        continue;
                    }
                    4..8 => {
                        let pause = Duration::from_secs(rng.random_range(10..600));
                        (workers[at].paused_until, n_faults) = (now + pause, n_faults + 1);
                        continue;
                    }
                    _ => {}
                }
                let one = &mut workers[at];
                one.beat += 1;
                let heartbeat = Heartbeat { beat: one.beat, ..Heartbeat::default() };
                folder.replace(&Heartbeat::name(&one.name), &serde_json::to_vec(&heartbeat).unwrap()).unwrap();
                match one.current {
                    Some((claim, until)) if now >= until => {
                        one.current = None;
                        let end = UnitEnd { worker: one.name.clone(), error: None, secs: 1.0 };
                        one.claims.end(claim, &end).unwrap();
                        n_twice += usize::from(ended.insert(claim.unit, claim.epoch).is_some());
                    }
                    Some(_) => {}
                    None => {
                        if let NextUnit::Claimed(claim) = one.claims.next(now + one.clock).unwrap() {
                            let needs = if claim.unit % 4 == 3 { claim.unit - 3..claim.unit } else { 0..0 };
                            assert!(needs.into_iter().all(|needed| ended.contains_key(&needed)), "seed {seed}");
                            one.current = Some((claim, now + Duration::from_secs(rng.random_range(30..900))));
                        }
                    }
                }
            }
        }
        assert!(n_twice <= n_faults, "seed {seed}: {n_twice} units done twice, {n_faults} faults");
        assert!(n_faults > 0);
    }
}

#[test]
fn dead_workers_are_replaced_slow_ones_keep_their_claims_and_failures_are_retried_once() {
    let folder = folder(Duration::ZERO, 1);
    let [mut a, mut b] = [0, 1].map(|number| worker(&folder, 2, number, false).claims);
    let secs = Duration::from_secs;
    let NextUnit::Claimed(first) = a.next(secs(0)).unwrap() else { panic!("no worker claimed a unit") };
    let second = Claim { unit: 1 - first.unit, epoch: 1 };
    assert_eq!(b.next(secs(0)).unwrap(), NextUnit::Claimed(second));
    let beat = |beat| serde_json::to_vec(&Heartbeat { beat, ..Heartbeat::default() }).unwrap();
    for at in 1..=30 {
        // A slow worker still beats.
        folder.replace("workers/w0.json", &beat(at)).unwrap();
        assert!(matches!(b.next(secs(60 * at)).unwrap(), NextUnit::Wait(_)));
    }
    assert!(a.is_mine(first).unwrap());
    // The waiting time grows up to a twelfth of the timeout for dead workers.
    assert_eq!(b.next(secs(60 * 30 + 179)).unwrap(), NextUnit::Wait(secs(15)));
    let takeover = Claim { epoch: 2, ..first };
    assert_eq!(b.next(secs(60 * 30 + 179 + 15)).unwrap(), NextUnit::Claimed(takeover));
    assert!(!a.is_mine(first).unwrap() && b.is_mine(takeover).unwrap());
    let end = |error: Option<&str>| UnitEnd { worker: "w".to_owned(), error: error.map(str::to_owned), secs: 1.0 };
    assert!(!a.end(first, &end(None)).unwrap(), "the unit was taken over");
    assert!(b.end(takeover, &end(Some("no image"))).unwrap());
    assert!(b.end(second, &end(None)).unwrap());
    assert_eq!(a.next(secs(0)).unwrap(), NextUnit::AllEnded);
    let mut again = worker(&folder, 2, 7, true).claims;
    let third = Claim { epoch: 3, ..first };
    assert_eq!(again.next(secs(0)).unwrap(), NextUnit::Claimed(third));
    assert!(again.end(third, &end(Some("no image"))).unwrap());
    assert_eq!(again.next(secs(1)).unwrap(), NextUnit::AllEnded);
}

#[test]
fn a_foreign_file_named_like_a_claim_blocks_only_its_unit() {
    let dir = tempfile::tempdir().unwrap();
    let folder = DiskFolder(dir.path().to_owned());
    let at = |name: &str| dir.path().join("claims/0000").join(name);
    // A folder and a damaged file are not claims, and a folder is not an end; unit 3 needs a unit that cannot be
    // claimed.
    std::fs::create_dir_all(at("000001.claim.0001")).unwrap();
    std::fs::write(at("000002.claim.0001"), "").unwrap();
    std::fs::create_dir(at("000004.end.0001")).unwrap();
    let needs = vec![vec![], vec![], vec![], vec![1], vec![]];
    let options = ClaimOptions { worker: "w".to_owned(), needs, order: (0..5).collect(), retries: false };
    let mut claims = Claims::new(&folder, options, BeatWatch::new(DEAD_AFTER, ""));
    let end = UnitEnd { worker: "w".to_owned(), error: None, secs: 1.0 };
    let mut ended = Vec::new();
    while let NextUnit::Claimed(claim) = claims.next(Duration::ZERO).unwrap() {
        claims.end(claim, &end).unwrap();
        ended.push(claim.unit);
    }
    ended.sort_unstable();
    assert_eq!(ended, [0, 4]);
    assert_eq!(claims.next(Duration::ZERO).unwrap(), NextUnit::Blocked);
    let files = ["claim", "claim", "end"].into_iter().zip([1, 2, 4]);
    let expected = files.map(|(kind, unit)| (unit, format!("claims/0000/{unit:06}.{kind}.0001"))).collect();
    assert_eq!(claims.blocked(), &expected);
    // Once the foreign folder is removed, a waiting worker claims the unit.
    std::fs::remove_dir(at("000001.claim.0001")).unwrap();
    assert!(matches!(claims.next(DEAD_AFTER).unwrap(), NextUnit::Wait(_)));
    for unit in [1, 3] {
        let claim = Claim { unit, epoch: 1 };
        assert_eq!(claims.next(DEAD_AFTER).unwrap(), NextUnit::Claimed(claim));
        assert!(claims.end(claim, &end).unwrap());
    }
    assert_eq!(claims.next(DEAD_AFTER).unwrap(), NextUnit::Blocked);
}

#[test]
fn an_unreadable_end_file_counts_as_a_failure() {
    let folder = folder(Duration::ZERO, 1);
    folder.create("claims/0000/000000.end.0001", b"").unwrap();
    let end = Claim { unit: 0, epoch: 1 }.read_end(&folder).unwrap().unwrap();
    assert!(end.error.unwrap().contains("000000.end.0001"));
}
