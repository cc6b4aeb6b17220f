//! `cargo bench -- claims`.

use super::report::Report;
use anyhow::{Result, bail, ensure};
use orator_base::stage::progress::Progress;
use orator_cluster::claims::{ClaimOptions, Claims, NextUnit, UnitEnd};
use orator_cluster::heartbeat::BeatWatch;
use orator_cluster::shared_folder::{DiskFolder, SharedFolder};
use serde_json::json;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Overhead of the claims of a plan: workers share units that take no time. Measures units per second, and operations
/// on the shared folder per unit.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Number of units in the plan.
    #[arg(long, default_value_t = 100_000, value_name = "N")]
    units: usize,
    /// Number of concurrent workers.
    #[arg(long, default_value_t = 8, value_name = "N")]
    workers: usize,
}

/// A shared folder that counts its operations.
struct CountingFolder {
    folder: DiskFolder,
    created: AtomicUsize,
    read: AtomicUsize,
    listed: AtomicUsize,
}

impl SharedFolder for CountingFolder {
    fn create(&self, name: &str, bytes: &[u8]) -> Result<bool> {
        self.created.fetch_add(1, Ordering::Relaxed);
        self.folder.create(name, bytes)
    }
    fn read(&self, name: &str) -> Result<Option<Vec<u8>>> {
        self.read.fetch_add(1, Ordering::Relaxed);
        self.folder.read(name)
    }
    fn list(&self, folder: &str) -> Result<Vec<String>> {
        self.listed.fetch_add(1, Ordering::Relaxed);
        self.folder.list(folder)
    }
    fn replace(&self, name: &str, bytes: &[u8]) -> Result<()> {
        self.folder.replace(name, bytes)
    }
}

pub(crate) fn run(args: &Args, progress: &dyn Progress) -> Result<Report> {
    ensure!(args.units > 0 && args.workers > 0, "units and workers must be more than 0");
    let dir = tempfile::tempdir()?;
    let folder = CountingFolder {
        folder: DiskFolder(dir.path().to_owned()),
        created: AtomicUsize::new(0),
        read: AtomicUsize::new(0),
        listed: AtomicUsize::new(0),
    };
    let task = progress.begin("claims", args.units as u64);
    let start = Instant::now();
    let work = |worker: usize| -> Result<usize> {
        let watch = BeatWatch::new(Duration::from_secs(180), "");
        let name = format!("worker-{worker}");
        let (needs, order) = (vec![Vec::new(); args.units], (0..args.units).collect());
        let mut claims =
            Claims::new(&folder, ClaimOptions { worker: name.clone(), needs, order, retries: false }, watch);
        let mut n_done = 0;
        loop {
            match claims.next(start.elapsed())? {
                NextUnit::Claimed(claim) => {
                    let end = UnitEnd { worker: name.clone(), error: None, secs: 0.0 };
                    ensure!(claims.end(claim, &end)?, "a unit of a live worker was taken over");
                    task.advance(1);
                    n_done += 1;
                }
                NextUnit::Wait(_) => std::thread::sleep(Duration::from_millis(20)),
                NextUnit::Blocked => bail!("blocked units: {:?}", claims.blocked()),
                NextUnit::AllEnded => return Ok(n_done),
            }
        }
    };
    let done: Vec<usize> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..args.workers).map(|worker| scope.spawn(move || work(worker))).collect();
        let ended =
            workers.into_iter().map(|worker| worker.join().unwrap_or_else(|_| anyhow::bail!("a worker panicked")));
        ended.collect::<Result<_>>()
    })?;
    ensure!(done.iter().sum::<usize>() == args.units, "{done:?} units done of {}", args.units);
    let secs = start.elapsed().as_secs_f64();
    let per_unit = |counter: &AtomicUsize| counter.load(Ordering::Relaxed) as f64 / args.units as f64;
    let (created, read, listed) = (per_unit(&folder.created), per_unit(&folder.read), per_unit(&folder.listed));
    let rate = args.units as f64 / secs;
    let text = format!(
        "{} units by {} workers in {secs:.1} s: {rate:.0} a second; a unit takes {created:.2} files to create (a draft, its flush, a \
         link, a removal each), {read:.2} to read, {listed:.4} listings\n",
        args.units, args.workers
    );
    let facts = json!({ "units": args.units, "workers": args.workers, "secs": secs, "created": created, "read": read, "listed": listed });
    Ok(Report { text, facts })
}
