//! The process of a unit as the run sees it: started, asked, followed to its answer, and ended when it passes its limits.

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

/// Bytes of what a process complained of that are kept: the last ones.
const MAX_COMPLAINT: usize = 2000;
/// Time between two checks of the limits.
const TICK: Duration = Duration::from_secs(1);
/// Clock ticks a second in `/proc/PID/stat`, on all machines.
const CLOCK_TICKS: f64 = 100.0;

/// A process at work, which ends with this value. It may have been taken over by what it read.
pub struct UnitProcess {
    child: Child,
    /// Open while the process may live.
    stdin: Option<ChildStdin>,
}

/// Standard output of a process, buffered.
pub type Answers<'a> = BufReader<CountedReader<'a>>;

impl UnitProcess {
    /// Starts `program` as the process of a unit.
    pub fn start(program: &Path) -> Result<Self> {
        let mut command = Command::new(program);
        command.arg(VERB);
        Self::start_command(command).with_context(|| format!("cannot start {}", program.display()))
    }

    fn start_command(mut command: Command) -> Result<Self> {
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // Ctrl-C is for the run alone, which ends its processes.
        command.process_group(0);
        ignore_stop_signals(&mut command);
        let mut child = command.spawn()?;
        let stdin = child.stdin.take();
        Ok(Self { child, stdin })
    }

    /// Sends the request. A process that is gone already is noticed by its silence.
    pub fn ask(&mut self, request: &Request) {
        let _ = self.stdin.as_mut().map(|stdin| send(stdin, request));
    }

    /// Lets `read` read the answer and ends the process, so that nothing is written after. Errors: how the process was
    /// lost.
    pub fn follow<T>(
        &mut self,
        limits: &Limits,
        read: impl FnOnce(&mut Answers<'_>) -> Result<T>,
    ) -> Result<T, String> {
        let (Some(out), Some(complaints)) = (self.child.stdout.take(), self.child.stderr.take()) else {
            return Err("has no pipes".to_owned());
        };
        let pid = Pid::from_child(&self.child);
        let n_reads = AtomicU64::new(0);
        let (result, complaint, passed) = std::thread::scope(|scope| {
            let complaint = scope.spawn(|| last_bytes(complaints));
            let (answered, ended) = channel();
            let watchdog = scope.spawn(|| watch(pid, limits, &n_reads, ended));
            let result = read(&mut BufReader::new(CountedReader { from: out, n_reads: &n_reads }));
            drop(answered);
            let passed = watchdog.join().unwrap_or_default();
            let _ = self.child.kill();
            (result, complaint.join().unwrap_or_default(), passed)
        });
        let status = self.child.wait();
        result.map_err(|error| {
            let is_end = |cause: &std::io::Error| cause.kind() == std::io::ErrorKind::UnexpectedEof;
            let death = match (passed, status) {
                (Some(passed), _) => passed,
                (None, Ok(status)) if error.chain().filter_map(|cause| cause.downcast_ref()).any(is_end) => {
                    death(status)
                }
                _ => "sent what makes no sense".to_owned(),
            };
            match plain(String::from_utf8_lossy(&complaint).trim()) {
                said if said.is_empty() => death,
                said => format!("{death}; it said: {said}"),
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

/// Standard output of a process, with the number of times that reading began or ended: it is odd while the run waits.
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

/// Ends the process when it passes a limit, and returns which; `None` when its answer came first. Time is counted in
/// ticks: while this program is suspended, it does not pass.
fn watch(pid: Pid, limits: &Limits, n_reads: &AtomicU64, ended: Receiver<()>) -> Option<String> {
    let (mut reads_before, mut cpu_before, mut cpu_at_report) = (0, 0.0, 0.0);
    let [mut passed, mut idle] = [0_u64; 2];
    while matches!(ended.recv_timeout(TICK), Err(RecvTimeoutError::Timeout)) {
        let reads = n_reads.load(Ordering::Relaxed);
        let (cpu, is_blocked) = cpu_secs(pid).unwrap_or((cpu_before, true));
        // A process whose reports nobody reads, since the terminal is stopped, has to wait.
        let has_report = reads != reads_before || reads.is_multiple_of(2);
        // Storage that does not answer (a tape library, a network file system) is waited for.
        idle = if has_report || is_blocked || cpu > cpu_before { 0 } else { idle + 1 };
        cpu_at_report = if has_report { cpu } else { cpu_at_report };
        (reads_before, cpu_before, passed) = (reads, cpu, passed + 1);
        let memory = anonymous_bytes(pid).and_then(|bytes| limits.exceeded_by(bytes));
        let verdict = memory.or_else(|| limits.passed([cpu, cpu - cpu_at_report], [passed, idle]));
        if verdict.is_some() {
            // The process is not waited for before this thread has ended: the id is still its own.
            let _ = kill_process(pid, Signal::KILL);
            return verdict;
        }
    }
    None
}

/// Seconds of processor time that the process has used, in the program and in the kernel, and whether it is in
/// uninterruptible sleep, as during a read from storage. `None`: unknown.
fn cpu_secs(pid: Pid) -> Option<(f64, bool)> {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", pid.as_raw_nonzero())).ok()?;
    // The name may hold anything. After it stand the state as field 3 and the two times as fields 14 and 15.
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

/// The last bytes that the process writes before it ends.
fn last_bytes(mut from: impl Read) -> Vec<u8> {
    let (mut last, mut piece) = (Vec::new(), [0; 4096]);
    while let Ok(n @ 1..) = from.read(&mut piece) {
        last.extend_from_slice(&piece[..n]);
        last.drain(..last.len().saturating_sub(MAX_COMPLAINT));
    }
    last
}

/// How a process ended before it had a result.
fn death(status: ExitStatus) -> String {
    if let Some(signal) = status.signal() {
        let why = match signal {
            6 => " (it gave up)",
            7 | 11 => " (it reached for memory that is not its own): the file may be damaged, or made to do harm",
            9 => " (killed: memory ran out, or by hand)",
            _ => "",
        };
        return format!("was ended by signal {signal}{why}");
    }
    format!("ended before it was done ({status})")
}

#[cfg(test)]
mod tests {
    use super::super::message::{Message, receive};
    use super::*;
    use std::time::Instant;

    /// What is reported of a process that runs the lines of shell and is followed within `limits`.
    fn followed(lines: &str, limits: &Limits) -> String {
        let mut command = Command::new("/bin/sh");
        command.args(["-c", lines]);
        let mut process = UnitProcess::start_command(command).unwrap();
        process.follow(limits, |answers| receive::<Message>(answers)).unwrap_err()
    }

    #[test]
    fn a_process_that_hangs_is_ended() {
        let begun = Instant::now();
        let limits = Limits { idle_secs: 2, ..Limits::of_header() };
        for hanging in ["exec sleep 1000", "kill -STOP $$"] {
            let error = followed(hanging, &limits);
            assert!(error.starts_with("did nothing for 2 s and was ended"), "{hanging}: {error}");
        }
        assert!(begun.elapsed() < Duration::from_secs(60));
    }

    #[test]
    fn a_process_that_never_ends_is_ended() {
        let limits = Limits { cpu_secs: 1, idle_secs: 1000, ..Limits::of_header() };
        let error = followed("while :; do :; done", &limits);
        assert!(error.starts_with("used more than the 1 s of processor time"), "{error}");
        let limits = Limits { quiet_secs: 1, idle_secs: 1000, ..Limits::of_header() };
        let error = followed("while :; do :; done", &limits);
        assert!(error.starts_with("reported no progress in 1 s of processor time"), "{error}");
    }

    #[test]
    fn signals_that_stop_a_run_do_not_end_its_processes() {
        let error = followed("kill -TERM $$; kill -INT $$; exit 7", &Limits::of_header());
        assert!(error.contains("exit status: 7"), "{error}");
    }
}
