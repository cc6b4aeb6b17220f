//! Heartbeats of workers: every worker increments a counter in its own file. A watcher detects dead workers from the
//! counter and its own clock alone, so the clocks of machines may differ by minutes.

use super::shared_folder::SharedFolder;
use anyhow::Result;
use orator_base::stage::workdir;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::time::Duration;

pub const WORKERS: &str = "workers";

/// Default time without a beat after which a worker counts as dead.
pub const DEAD_AFTER: Duration = Duration::from_secs(180);

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Heartbeat {
    /// Counter, incremented at every beat.
    pub beat: u64,
    pub host: String,
    /// Identifier of the machine or container; empty if unknown.
    pub machine: String,
    /// Process id on that machine.
    pub pid: u32,
    /// Start time by the machine's clock, seconds since 1970; for display only.
    pub started: u64,
    /// Whether the worker exited in order and holds no unit.
    pub ended: bool,
    pub n_done: usize,
    pub n_failed: usize,
    /// Duration of the video in the units done, seconds.
    pub media_secs: f64,
    /// Time since the start, seconds, by the worker's own clock.
    pub secs: f64,
    /// Unit in progress.
    pub unit: Option<String>,
}

impl Heartbeat {
    /// Path of a worker's file in the shared folder.
    pub fn name(worker: &str) -> String {
        format!("{WORKERS}/{worker}.json")
    }

    /// Reads the last status of a worker; `None` if there is none or it is incomplete.
    pub fn read(folder: &impl SharedFolder, worker: &str) -> Result<Option<Self>> {
        let bytes = folder.read(&Self::name(worker))?;
        Ok(bytes.and_then(|bytes| serde_json::from_slice(&bytes).ok()))
    }

    /// Throughput, seconds of video per second.
    pub fn media_rate(&self) -> f64 {
        self.media_secs / self.secs.max(1.0)
    }

    /// Whether the worker is known to have exited: its status says so, or its process on this machine no longer exists.
    pub fn is_over(&self, machine: &str) -> bool {
        self.ended || (!machine.is_empty() && self.machine == machine && !workdir::is_alive(self.pid))
    }
}

/// Host name and identifier of the machine (or container) that this program runs on.
pub fn this_machine() -> (String, String) {
    let host = rustix::system::uname().nodename().to_string_lossy().into_owned();
    (host, workdir::machine().to_owned())
}

/// Detects dead workers by their heartbeats.
pub struct BeatWatch {
    /// Must exceed the cache lifetime of the network file system.
    dead_after: Duration,
    machine: String,
    /// Last beat of each worker, and when the watcher first saw that beat.
    last_beats: BTreeMap<String, (Option<u64>, Duration)>,
}

impl BeatWatch {
    pub fn new(dead_after: Duration, machine: &str) -> Self {
        Self { dead_after, machine: machine.to_owned(), last_beats: BTreeMap::new() }
    }

    /// Time between two checks: dead workers are detected at most a twelfth of `dead_after` late.
    pub fn interval(&self) -> Duration {
        self.dead_after / 12
    }

    /// Whether the worker is dead at the time `now` on the watcher's clock. A worker seen for the first time counts as
    /// alive unless it is known to have exited.
    pub fn is_dead(&mut self, folder: &impl SharedFolder, worker: &str, now: Duration) -> Result<bool> {
        let heartbeat = Heartbeat::read(folder, worker)?;
        if heartbeat.as_ref().is_some_and(|heartbeat| heartbeat.is_over(&self.machine)) {
            return Ok(true);
        }
        let beat = heartbeat.map(|heartbeat| heartbeat.beat);
        let last = self.last_beats.entry(worker.to_owned()).or_insert((beat, now));
        // A cache may return an older beat again, so only a higher one counts.
        if beat > last.0 {
            *last = (beat, now);
        }
        Ok(now.saturating_sub(last.1) >= self.dead_after)
    }
}
