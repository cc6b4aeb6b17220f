//! Parent side of a subprocess: start it, send the request, wait for the answer, kill it beyond its limits.

use super::failure::plain;
use super::limits::Limits;
use super::message::{Request, send};
use super::unit::VERB;
use anyhow::{Context, Result};
use orator_media::sandbox::ignore_stop_signals;
use rustix::process::{Pid, Signal, kill_process};
use std::io::{BufReader, Read};
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

/// Bytes of standard error that are stored, counted from the end.
const MAX_STDERR_BYTES: usize = 2000;
/// Interval between two checks of the limits.
const TICK: Duration = Duration::from_secs(1);
/// Clock ticks per second in `/proc/PID/stat`, on all machines.
const CLOCK_TICKS: f64 = 100.0;

/// A running subprocess, killed on drop. It may be compromised by the file that it reads.
pub struct UnitProcess {
    child: Child,
    /// Held open while the process may live: it exits when this pipe closes.
    stdin: Option<ChildStdin>,
}

/// Buffered standard output of a subprocess.
pub type Answers<'a> = BufReader<CountedReader<'a>>;

impl UnitProcess {
    /// Starts `program` as a subprocess.
    pub fn start(program: &Path) -> Result<Self> {
        let mut command = Command::new(program);
        command.arg(VERB);
        Self::start_command(command).with_context(|| format!("cannot start {}", program.display()))
    }

    fn start_command(mut command: Command) -> Result<Self> {
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // Ctrl-C must reach only the run, which then ends its subprocesses.
        command.process_group(0);
        ignore_stop_signals(&mut command);
        let mut child = command.spawn()?;
        let stdin = child.stdin.take();
        Ok(Self { child, stdin })
    }

    /// Sends the request. If the process has already exited, reading its answer fails.
    pub fn ask(&mut self, request: &Request) {
        let _ = self.stdin.as_mut().map(|stdin| send(stdin, request));
    }

    /// Reads with `read`, which may answer on standard input, then kills the process, so that it writes nothing more.
    /// The error says how it ended.
    pub fn follow<T>(
        &mut self,
        limits: &Limits,
        read: impl FnOnce(&mut Answers<'_>, &mut Option<ChildStdin>) -> Result<T>,
    ) -> Result<T, String> {
        let (Some(out), Some(stderr)) = (self.child.stdout.take(), self.child.stderr.take()) else {
            return Err("has no pipes".to_owned());
        };
        let pid = Pid::from_child(&self.child);
        let n_reads = AtomicU64::new(0);
        let (result, stderr_tail, passed) = std::thread::scope(|scope| {
            let stderr_tail = scope.spawn(|| last_bytes(stderr));
            let (answered, stop) = channel();
            let watchdog = scope.spawn(|| watch(pid, limits, &n_reads, stop));
            let result = read(&mut BufReader::new(CountedReader { from: out, n_reads: &n_reads }), &mut self.stdin);
            drop(answered);
            let passed = watchdog.join().unwrap_or_default();
            let _ = self.child.kill();
            (result, stderr_tail.join().unwrap_or_default(), passed)
        });
        let status = self.child.wait();
        result.map_err(|error| {
            let is_end = |cause: &std::io::Error| cause.kind() == std::io::ErrorKind::UnexpectedEof;
            let death = match (passed, status) {
                (Some(passed), _) => passed,
                (None, Ok(status)) if error.chain().filter_map(|cause| cause.downcast_ref()).any(is_end) => {
                    death(status)
                }
                _ => "sent an invalid answer".to_owned(),
            };
            match plain(String::from_utf8_lossy(&stderr_tail).trim()) {
                text if text.is_empty() => death,
                text => format!("{death}; its error output: {text}"),
            }
        })
    }
}

impl Drop for UnitProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Standard output of a subprocess, with a counter incremented before and after each read: odd while waiting.
pub struct CountedReader<'a> {
    from: ChildStdout,
    n_reads: &'a AtomicU64,
}

impl Read for CountedReader<'_> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        self.n_reads.fetch_add(1, Ordering::Relaxed);
        let read = self.from.read(into);
        self.n_reads.fetch_add(1, Ordering::Relaxed);
        read
    }
}

/// Kills the process when it exceeds a limit and returns which; `None` if the answer came first. Time is counted in
/// ticks, so it does not advance while this program is suspended.
fn watch(pid: Pid, limits: &Limits, n_reads: &AtomicU64, stop: Receiver<()>) -> Option<String> {
    let (mut reads_before, mut cpu_before, mut cpu_at_report) = (0, 0.0, 0.0);
    let [mut passed, mut idle] = [0_u64; 2];
    while matches!(stop.recv_timeout(TICK), Err(RecvTimeoutError::Timeout)) {
        let reads = n_reads.load(Ordering::Relaxed);
        let (cpu, is_blocked) = cpu_secs(pid).unwrap_or((cpu_before, true));
        // If the run is not reading (e.g. the terminal is stopped), the process is blocked on its output and not idle.
        let has_report = reads != reads_before || reads.is_multiple_of(2);
        // Waiting for storage that does not answer (a tape library, a network file system) does not count as idle.
        idle = if has_report || is_blocked || cpu > cpu_before { 0 } else { idle + 1 };
        cpu_at_report = if has_report { cpu } else { cpu_at_report };
        (reads_before, cpu_before, passed) = (reads, cpu, passed + 1);
        let memory = anonymous_bytes(pid).and_then(|bytes| limits.exceeded_by(bytes));
        let excess = memory.or_else(|| limits.passed([cpu, cpu - cpu_at_report], [passed, idle]));
        if excess.is_some() {
            // The process is not reaped before this thread has ended, so the id still refers to it.
            let _ = kill_process(pid, Signal::KILL);
            return excess;
        }
    }
    None
}

/// CPU seconds that the process has used, in user and kernel mode, and whether it is in uninterruptible sleep, as during
/// a read from storage. `None`: unknown.
fn cpu_secs(pid: Pid) -> Option<(f64, bool)> {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", pid.as_raw_nonzero())).ok()?;
    // The process name may contain anything, so parsing starts after it: field 3 is the state, 14 and 15 are the times.
    let (_, fields) = stat.rsplit_once(')')?;
    let ticks = fields.split_whitespace().skip(11).take(2).map(|ticks| ticks.parse::<u64>().ok());
    let is_blocked = fields.trim_start().starts_with('D');
    Some((ticks.sum::<Option<u64>>()? as f64 / CLOCK_TICKS, is_blocked))
}

/// Bytes of memory in use by the process that no file backs. `RLIMIT_DATA` counts only what is writable at the moment.
fn anonymous_bytes(pid: Pid) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{}/status", pid.as_raw_nonzero())).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("RssAnon:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// Last `MAX_STDERR_BYTES` bytes that the process writes.
fn last_bytes(mut from: impl Read) -> Vec<u8> {
    let (mut last, mut piece) = (Vec::new(), [0; 4096]);
    while let Ok(n @ 1..) = from.read(&mut piece) {
        last.extend_from_slice(&piece[..n]);
        last.drain(..last.len().saturating_sub(MAX_STDERR_BYTES));
    }
    last
}

/// Describes how a process ended without a result.
fn death(status: ExitStatus) -> String {
    if let Some(signal) = status.signal() {
        let cause = match signal {
            6 => " (aborted)",
            7 | 11 => " (invalid memory access): the file may be damaged or malicious",
            9 => " (killed by a user, or because memory ran out)",
            _ => "",
        };
        return format!("was ended by signal {signal}{cause}");
    }
    format!("exited before it finished ({status})")
}

#[cfg(test)]
mod tests {
    use super::super::message::{Message, receive};
    use super::*;
    use std::time::Instant;

    /// Runs a shell script within `limits` and returns the error.
    fn error_of(lines: &str, limits: &Limits) -> String {
        let mut command = Command::new("/bin/sh");
        command.args(["-c", lines]);
        let mut process = UnitProcess::start_command(command).unwrap();
        process.follow(limits, |answers, _| receive::<Message>(answers)).unwrap_err()
    }

    #[test]
    fn a_hanging_process_is_killed() {
        let start = Instant::now();
        let limits = Limits { idle_secs: 2, ..Limits::of_header() };
        for hanging in ["exec sleep 1000", "kill -STOP $$"] {
            let error = error_of(hanging, &limits);
            assert!(error.starts_with("was idle for 2 s and was killed"), "{hanging}: {error}");
        }
        assert!(start.elapsed() < Duration::from_secs(60));
    }

    #[test]
    fn a_process_over_its_cpu_limit_is_killed() {
        let limits = Limits { cpu_secs: 1, idle_secs: 1000, ..Limits::of_header() };
        let error = error_of("while :; do :; done", &limits);
        assert!(error.starts_with("used more than the 1 s of CPU time"), "{error}");
        let limits = Limits { report_secs: 1, idle_secs: 1000, ..Limits::of_header() };
        let error = error_of("while :; do :; done", &limits);
        assert!(error.starts_with("reported no progress in 1 s of CPU time"), "{error}");
    }
}
