//! Who is at work: every worker counts on in a file of its own. Whether one is dead is seen from its count alone, by the
//! watcher's own clock, so that the clocks of machines may differ by minutes.

use super::shared_folder::SharedFolder;
use anyhow::Result;
use orator_base::stage::workdir;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::time::Duration;

/// Folder of the workers' files.
pub const WORKERS: &str = "workers";

/// Time without a beat after which a worker is dead, unless another is asked for.
pub const DEAD_AFTER: Duration = Duration::from_secs(180);

/// What a worker says of itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Heartbeat {
    /// Goes up with every beat.
    pub beat: u64,
    /// The machine's name.
    pub host: String,
    /// Tells machines, and containers on one machine, apart; empty: not known.
    pub machine: String,
    /// The process on that machine.
    pub pid: u32,
    /// Start by the machine's clock, seconds since 1970; for people.
    pub started: u64,
    /// Whether the worker ended by itself, with nothing in its hands.
    pub ended: bool,
    /// Units that it has done, and that failed in its hands.
    pub n_done: usize,
    /// Units that failed.
    pub n_failed: usize,
    /// Seconds of video in the units done.
    pub media_secs: f64,
    /// Seconds since its start, by its own clock.
    pub secs: f64,
    /// Unit in its hands.
    pub unit: Option<String>,
}

impl Heartbeat {
    /// The file of a worker.
    pub fn name(worker: &str) -> String {
        format!("{WORKERS}/{worker}.json")
    }

    /// What a worker said last; `None`: nothing yet, or half of it.
    pub fn read(folder: &impl SharedFolder, worker: &str) -> Result<Option<Self>> {
        let bytes = folder.read(&Self::name(worker))?;
        Ok(bytes.and_then(|bytes| serde_json::from_slice(&bytes).ok()))
    }

    /// Seconds of video a second.
    pub fn media_rate(&self) -> f64 {
        self.media_secs / self.secs.max(1.0)
    }

    /// Whether it is known without waiting that the worker is gone: it said so, or it was a process of this machine that
    /// is no more.
    pub fn is_over(&self, machine: &str) -> bool {
        self.ended || (!machine.is_empty() && self.machine == machine && !workdir::is_alive(self.pid))
    }
}

/// The name of the machine that this program is on, and what identifies machines and containers.
pub fn this_machine() -> (String, String) {
    let host = rustix::system::uname().nodename().to_string_lossy().into_owned();
    (host, workdir::machine().to_owned())
}

/// Watches the beats of other workers.
pub struct BeatWatch {
    /// More than a network file system keeps what it knows.
    dead_after: Duration,
    machine: String,
    /// Last beat of each worker, and when it was seen first.
    seen: BTreeMap<String, (Option<u64>, Duration)>,
}

impl BeatWatch {
    /// A watcher on `machine`.
    pub fn new(dead_after: Duration, machine: &str) -> Self {
        Self { dead_after, machine: machine.to_owned(), seen: BTreeMap::new() }
    }

    /// Time between two checks: the dead are found a twelfth later than they are known to be dead.
    pub fn interval(&self) -> Duration {
        self.dead_after / 12
    }

    /// Whether the worker is dead at the time `now` of the watcher's clock. One seen for the first time is not, unless that
    /// is known.
    pub fn is_dead(&mut self, folder: &impl SharedFolder, worker: &str, now: Duration) -> Result<bool> {
        let heartbeat = Heartbeat::read(folder, worker)?;
        if heartbeat.as_ref().is_some_and(|heartbeat| heartbeat.is_over(&self.machine)) {
            return Ok(true);
        }
        let beat = heartbeat.map(|heartbeat| heartbeat.beat);
        let seen = self.seen.entry(worker.to_owned()).or_insert((beat, now));
        // A cache may show an older beat again: only more is news.
        if beat > seen.0 {
            *seen = (beat, now);
        }
        Ok(now.saturating_sub(seen.1) >= self.dead_after)
    }
}
