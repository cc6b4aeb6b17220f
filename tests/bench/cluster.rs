//! `cargo bench -- cluster`.

use super::report::Report;
use anyhow::{Result, ensure};
use orator_base::stage::progress::Progress;
use orator_cluster::claims::{Claim, ClaimOptions, Claims, NextUnit, UnitEnd};
use orator_cluster::heartbeat::{BeatWatch, DEAD_AFTER, Heartbeat, WORKERS};
use orator_cluster::plan::{PART_SECS, PlannedUnit, UnitShare, split_and_sort};
use orator_cluster::shared_folder::SharedFolder;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use std::cell::{Cell, RefCell};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::time::Duration;

/// Simulation of many workers on one plan, with simulated time but the claims of the program: worker efficiency and
/// load of the shared folder. Videos of 2 minutes to 3 hours; of every hundred units two fail and two crash their
/// worker, which restarts ten minutes later; every twentieth worker is three times slower.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Hours of video.
    #[arg(long, default_value_t = 1000.0, value_name = "HOURS")]
    hours: f64,
    /// Numbers of workers to simulate.
    #[arg(long, default_value = "64,256,1024", value_delimiter = ',', value_name = "N,N,...")]
    workers: Vec<usize>,
    /// Latency of an operation on the shared folder.
    #[arg(long, default_value_t = 2.0, value_name = "MILLISECONDS")]
    latency: f64,
    /// Seconds of work per second of video.
    #[arg(long, default_value_t = 0.4, value_name = "SECONDS")]
    cost: f64,
}

/// Heartbeat interval.
const BEAT: Duration = Duration::from_secs(15);
const RESTART_AFTER: Duration = Duration::from_secs(600);
const SLOW: f64 = 3.0;

/// A shared folder in memory that counts its operations.
#[derive(Default)]
struct SimulatedFolder {
    files: RefCell<BTreeMap<String, BTreeMap<String, Vec<u8>>>>,
    /// Start and end time of every worker, by its number.
    lives: RefCell<Vec<(Duration, Option<Duration>)>>,
    now: Cell<Duration>,
    /// Numbers of files created, files read and folders listed.
    n_operations: [Cell<u64>; 3],
}

impl SimulatedFolder {
    fn count(&self, kind: usize) {
        self.n_operations[kind].set(self.n_operations[kind].get() + 1);
    }

    fn total_operations(&self) -> u64 {
        self.n_operations.iter().map(Cell::get).sum()
    }
}

fn split(name: &str) -> (&str, &str) {
    name.rsplit_once('/').unwrap_or(("", name))
}

impl SharedFolder for SimulatedFolder {
    fn create(&self, name: &str, bytes: &[u8]) -> Result<bool> {
        self.count(0);
        let (folder, file) = split(name);
        let mut files = self.files.borrow_mut();
        let folder = files.entry(folder.to_owned()).or_default();
        let is_new = !folder.contains_key(file);
        folder.entry(file.to_owned()).or_insert_with(|| bytes.to_vec());
        Ok(is_new)
    }

    fn read(&self, name: &str) -> Result<Option<Vec<u8>>> {
        self.count(1);
        let (folder, file) = split(name);
        if folder != WORKERS {
            return Ok(self.files.borrow().get(folder).and_then(|files| files.get(file)).cloned());
        }
        // A live worker has written a heartbeat once per interval.
        let number: usize = file.trim_end_matches(".json").parse()?;
        let (started, ended) = self.lives.borrow()[number];
        let n_beats = ended.unwrap_or(self.now.get()).saturating_sub(started).as_secs() / BEAT.as_secs();
        Ok(Some(serde_json::to_vec(&Heartbeat { beat: 1 + n_beats, ..Heartbeat::default() })?))
    }

    fn list(&self, folder: &str) -> Result<Vec<String>> {
        self.count(2);
        Ok(self.files.borrow().get(folder).map(|files| files.keys().cloned().collect()).unwrap_or_default())
    }

    fn replace(&self, _name: &str, _bytes: &[u8]) -> Result<()> {
        Ok(())
    }
}

/// Videos with a total duration of `secs`: mostly about ten minutes each, a few of hours.
fn videos(secs: f64, rng: &mut ChaCha8Rng) -> Vec<PlannedUnit> {
    let (mut videos, mut remaining) = (Vec::new(), secs);
    while remaining > 0.0 {
        let normal: f64 = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let length = (900.0 * normal.exp()).clamp(120.0, 10_800.0).min(remaining.max(120.0));
        remaining -= length;
        let name = format!("video-{:06}", videos.len());
        videos.push(PlannedUnit {
            speaker: "host".to_owned(),
            source: (&name).into(),
            video: name,
            inputs: Vec::new(),
            secs: Some(length),
            share: UnitShare::AllStages,
            needs: Vec::new(),
        });
    }
    videos
}

/// Seconds of work on a unit: a twentieth of the work on a video is the first stage, another the stages after `pose2d`.
fn work_secs(unit: &PlannedUnit, cost: f64) -> f64 {
    let video_work = cost * unit.secs.unwrap_or(0.0);
    match unit.share {
        UnitShare::Extract => 0.05 * video_work,
        UnitShare::Parts { of, .. } => 0.9 * video_work / of as f64,
        UnitShare::AllStages if unit.needs.is_empty() => video_work,
        UnitShare::AllStages => 0.05 * video_work,
    }
}

struct SimulatedWorker<'a> {
    claims: Claims<'a, SimulatedFolder>,
    number: usize,
    slowness: f64,
    /// The claimed unit, and whether it crashes the worker.
    claimed: Option<(Claim, bool)>,
}

/// Result of a simulation.
struct SimulationResult {
    secs: f64,
    efficiency: f64,
    /// Units that two workers completed.
    twice: usize,
    /// Files created, files read and folders listed per unit.
    per_unit: [f64; 3],
    /// Operations per second: mean, and in the busiest ten seconds.
    rate: [f64; 2],
}

fn simulate(units: &[PlannedUnit], n_workers: usize, args: &Args) -> Result<SimulationResult> {
    let mut rng = ChaCha8Rng::seed_from_u64(n_workers as u64);
    let folder = SimulatedFolder::default();
    let needs: Vec<Vec<usize>> = units.iter().map(|unit| unit.needs.clone()).collect();
    let start_worker = |at: Duration, slowness: f64| {
        let number = folder.lives.borrow().len();
        folder.lives.borrow_mut().push((at, None));
        let watch = BeatWatch::new(DEAD_AFTER, "");
        let (needs, order) = (needs.clone(), (0..units.len()).collect());
        let options = ClaimOptions { worker: number.to_string(), needs, order, retries: false };
        let claims = Claims::new(&folder, options, watch);
        SimulatedWorker { claims, number, slowness, claimed: None }
    };
    let mut workers: Vec<SimulatedWorker> =
        (0..n_workers).map(|at| start_worker(Duration::ZERO, if at % 20 == 19 { SLOW } else { 1.0 })).collect();
    let mut events: BinaryHeap<Reverse<(Duration, usize)>> =
        (0..n_workers).map(|at| Reverse((Duration::from_millis(37 * at as u64), at))).collect();
    let mut ended = vec![false; units.len()];
    let (mut twice, mut last_end, mut buckets) = (0, Duration::ZERO, BTreeMap::<u64, u64>::new());
    while let Some(Reverse((now, at))) = events.pop() {
        folder.now.set(now);
        let before = folder.total_operations();
        let worker = &mut workers[at];
        if let Some((claim, is_fatal)) = worker.claimed.take() {
            if is_fatal {
                folder.lives.borrow_mut()[worker.number].1 = Some(now);
                let slowness = worker.slowness;
                workers[at] = start_worker(now + RESTART_AFTER, slowness);
                events.push(Reverse((now + RESTART_AFTER, at)));
                continue;
            }
            let error = rng.random_bool(0.02).then(|| "it failed".to_owned());
            worker.claims.end(claim, &UnitEnd { worker: worker.number.to_string(), error, secs: 0.0 })?;
            twice += usize::from(std::mem::replace(&mut ended[claim.unit], true));
            last_end = last_end.max(now);
        }
        let next = worker.claims.next(now)?;
        let n_operations = folder.total_operations() - before;
        *buckets.entry(now.as_secs() / 10).or_default() += n_operations;
        let latency = Duration::from_secs_f64(n_operations as f64 * args.latency / 1000.0);
        match next {
            NextUnit::Claimed(claim) => {
                let spread = 0.7 + 0.6 * rng.random::<f64>();
                let mut secs = work_secs(&units[claim.unit], args.cost) * worker.slowness * spread;
                let is_fatal = rng.random_bool(0.02);
                secs *= if is_fatal { rng.random::<f64>() } else { 1.0 };
                worker.claimed = Some((claim, is_fatal));
                events.push(Reverse((now + latency + Duration::from_secs_f64(secs), at)));
            }
            NextUnit::Wait(time) => events.push(Reverse((now + latency + time, at))),
            NextUnit::Blocked | NextUnit::AllEnded => {}
        }
    }
    ensure!(ended.iter().all(|ended| *ended), "a unit was not completed");
    let work: f64 = units.iter().map(|unit| work_secs(unit, args.cost)).sum();
    let speed: f64 = workers.iter().map(|worker| 1.0 / worker.slowness).sum();
    let secs = last_end.as_secs_f64();
    let per_unit = |kind: usize| folder.n_operations[kind].get() as f64 / units.len() as f64;
    let beats = n_workers as f64 / BEAT.as_secs_f64();
    let most = buckets.values().copied().max().unwrap_or(0) as f64 / 10.0;
    Ok(SimulationResult {
        secs,
        efficiency: work / speed / secs,
        twice,
        per_unit: [0, 1, 2].map(per_unit),
        rate: [folder.total_operations() as f64 / secs + beats, most + beats],
    })
}

pub(crate) fn run(args: &Args, progress: &dyn Progress) -> Result<Report> {
    ensure!(args.hours > 0.0 && args.workers.iter().all(|n| *n > 0), "hours and workers must be more than 0");
    let videos = videos(3600.0 * args.hours, &mut ChaCha8Rng::seed_from_u64(0));
    let n_videos = videos.len();
    let units = split_and_sort(videos, PART_SECS);
    let mut text = format!("{:.0} h in {n_videos} videos, {} units\n", args.hours, units.len());
    text += "workers   hours  efficiency  twice  created / read / listed a unit   operations a second, most\n";
    let task = progress.begin("cluster", args.workers.len() as u64);
    let mut rows = Vec::new();
    for &n in &args.workers {
        let SimulationResult { secs, efficiency, twice, per_unit: [created, read, listed], rate: [mean, most] } =
            simulate(&units, n, args)?;
        let hours = secs / 3600.0;
        text += &format!(
            "{n:7} {hours:7.2} {:9.1} % {twice:6}  {created:7.2} {read:7.1} {listed:7.2}             {mean:12.0} {most:9.0}\n",
            100.0 * efficiency
        );
        rows.push(json!({
            "workers": n, "hours": hours, "efficiency": efficiency, "twice": twice, "created": created, "read": read,
            "listed": listed, "operations_a_second": mean, "most_a_second": most,
        }));
        task.advance(1);
    }
    Ok(Report { text, facts: json!({ "videos": n_videos, "units": units.len(), "rows": rows }) })
}
