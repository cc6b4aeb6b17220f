//! Subprocesses that SIGINT and SIGTERM do not end: schedulers send these to every process of a job, and the parent decides
//! what happens to its subprocesses.

use std::os::unix::process::CommandExt as _;
use std::process::Command;

/// Lets the program that `command` starts ignore SIGINT and SIGTERM from its first instruction on. The standard library
/// resets the mask of blocked signals on `exec`, but ignored signals stay ignored.
pub fn ignore_stop_signals(command: &mut Command) {
    let ignore = || {
        for signal in [libc::SIGINT, libc::SIGTERM] {
            // SAFETY: `signal` is async-signal-safe and sets a disposition of this process alone.
            if unsafe { libc::signal(signal, libc::SIG_IGN) } == libc::SIG_ERR {
                return Err(std::io::Error::last_os_error());
            }
        }
        Ok(())
    };
    // SAFETY: between `fork` and `exec` the closure calls `signal` alone, and allocates nothing.
    unsafe { command.pre_exec(ignore) };
}
