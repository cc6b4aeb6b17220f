//! Information about processes from the system: whether one runs, when it started, and on which machine.

use rustix::io::Errno;
use rustix::process::{Pid, test_kill_process};
use std::fs;
use std::sync::OnceLock;

/// Field positions in `/proc/PID/stat`, counted after the process name.
const STATE: usize = 0;
const START: usize = 19;

/// Returns whether a process with this id runs on this machine. A zombie does not count: it has ended, and its parent
/// has not collected its exit status.
pub fn is_alive(process: u32) -> bool {
    let pid = i32::try_from(process).ok().and_then(Pid::from_raw);
    let is_there = pid.is_some_and(|pid| test_kill_process(pid) != Err(Errno::SRCH));
    // Without /proc, or if it hides the process, it is enough that a signal can be sent.
    is_there && !stat(process, STATE).is_some_and(|state| ["Z", "X", "x"].contains(&&*state))
}

/// Returns the start time of a process in clock ticks since boot, which clock changes do not affect; `None`: unknown.
pub(super) fn started(process: u32) -> Option<u64> {
    stat(process, START)?.parse().ok()
}

fn stat(process: u32, field: usize) -> Option<String> {
    let stat = fs::read(format!("/proc/{process}/stat")).ok()?;
    let stat = String::from_utf8_lossy(&stat);
    // The process name, in parentheses, may contain any character.
    let (_, fields) = stat.rsplit_once(')')?;
    fields.split_whitespace().nth(field).map(str::to_owned)
}

/// Identifies this boot of this machine, and the container: 16 hex digits; empty if the system has no boot id.
pub fn machine() -> &'static str {
    static MACHINE: OnceLock<String> = OnceLock::new();
    MACHINE.get_or_init(|| {
        let boot = fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
        // Each container has its own process ids.
        let processes = fs::read_link("/proc/self/ns/pid").unwrap_or_default();
        match boot.trim() {
            "" => String::new(),
            boot => blake3::hash(format!("{boot} {}", processes.display()).as_bytes()).to_hex()[..16].to_owned(),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;
    use std::time::{Duration, Instant};

    #[test]
    fn a_zombie_is_not_alive() {
        let mut child = Command::new("sleep").arg("60").spawn().unwrap();
        let process = child.id();
        assert!(is_alive(process) && is_alive(std::process::id()));
        child.kill().unwrap();
        // Its exit status has not been collected yet.
        let begun = Instant::now();
        while is_alive(process) {
            assert!(begun.elapsed() < Duration::from_secs(10), "a zombie counts as alive");
            std::thread::sleep(Duration::from_millis(5));
        }
        assert!(stat(process, STATE).is_some_and(|state| state == "Z"));
        child.wait().unwrap();
        assert!(!is_alive(process));
    }

    #[test]
    fn start_times_and_host_ids_are_available() {
        let own = started(std::process::id()).unwrap();
        assert!(own >= started(1).unwrap_or(0));
        assert_eq!(machine().len(), 16);
    }
}
