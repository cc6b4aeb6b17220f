//! Runs `orator` as a child process and measures its wall time, peak memory and processor use; and memory and processor
//! time of the benchmark itself.

use anyhow::{Result, ensure};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Sampling interval.
const SAMPLING_INTERVAL: Duration = Duration::from_millis(5);
/// Clock ticks per second in /proc, on every Linux.
const TICKS: f64 = 100.0;

/// Measurements of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Child {
    pub(crate) secs: f64,
    /// Peak resident memory.
    pub(crate) peak_mib: f64,
    /// User and system processor time, seconds.
    pub(crate) cpu_secs: f64,
    /// Mean number of running or runnable threads, at most the number of cores: the cores that would have been busy on
    /// an otherwise idle machine.
    pub(crate) busy: f64,
}

/// Runs `orator ARGS` in the folder `dir`.
///
/// # Errors
/// Fails if the program cannot be started, or with its error output if it fails.
pub(crate) fn measure(dir: &Path, args: &[&str]) -> Result<Child> {
    let n_cores = std::thread::available_parallelism().map_or(1, |n| n.get());
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    let log = fs::File::create(dir.join("bench.log"))?;
    command.current_dir(dir).args(args).stdin(Stdio::null()).stdout(Stdio::null()).stderr(log);
    let (start, mut child) = (Instant::now(), command.spawn()?);
    let folder = format!("/proc/{}", child.id());
    let (mut peak_mib, mut cpu_secs, mut n_samples, mut n_busy) = (0.0f64, 0.0f64, 0usize, 0usize);
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        let text = |name: &str| fs::read_to_string(format!("{folder}/{name}")).unwrap_or_default();
        peak_mib = peak_mib.max(high_water_mib(&text("status")).unwrap_or(0.0));
        cpu_secs = cpu_secs.max(ticks(&text("stat")).unwrap_or(0.0) / TICKS);
        n_busy += n_running(&folder).min(n_cores);
        n_samples += 1;
        std::thread::sleep(SAMPLING_INTERVAL);
    };
    let secs = start.elapsed().as_secs_f64();
    let log = fs::read_to_string(dir.join("bench.log")).unwrap_or_default();
    ensure!(status.success(), "`orator {}` failed: {}", args.join(" "), log.trim());
    Ok(Child { secs, peak_mib, cpu_secs, busy: n_busy as f64 / n_samples.max(1) as f64 })
}

/// Peak resident memory of this process so far.
pub(crate) fn own_peak_mib() -> f64 {
    fs::read_to_string("/proc/self/status").ok().as_deref().and_then(high_water_mib).unwrap_or(f64::NAN)
}

/// Processor time of this process so far, seconds: on a busy machine it is more reliable than wall time.
pub(crate) fn own_cpu_secs() -> f64 {
    fs::read_to_string("/proc/self/stat").ok().as_deref().and_then(ticks).map_or(f64::NAN, |ticks| ticks / TICKS)
}

/// Peak resident memory from a `status` file of /proc.
pub(crate) fn high_water_mib(status: &str) -> Option<f64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.split_whitespace().next()?.parse::<f64>().ok()? / 1024.0)
}

/// Sum of fields 14 and 15 of `stat` (user and system time), counted from the end of the name in parentheses.
pub(crate) fn ticks(stat: &str) -> Option<f64> {
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    Some(fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?)
}

/// Number of threads that are running or waiting for a core.
pub(crate) fn n_running(folder: &str) -> usize {
    let threads = fs::read_dir(Path::new(folder).join("task")).into_iter().flatten().flatten();
    let state = |stat: String| stat.rsplit_once(')').and_then(|(_, rest)| rest.trim_start().chars().next());
    let states = threads.filter_map(|thread| fs::read_to_string(thread.path().join("stat")).ok().and_then(state));
    states.filter(|state| *state == 'R').count()
}
