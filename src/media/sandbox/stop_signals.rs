//! Subprocesses that ignore SIGINT and SIGTERM: schedulers send these signals to every process of a job, but the
//! parent decides when its subprocesses stop.

use std::os::unix::process::CommandExt as _;
use std::process::Command;

/// Makes the program started by `command` ignore SIGINT and SIGTERM from its first instruction on. The standard
/// library resets the mask of blocked signals on `exec`, but ignored signals stay ignored.
pub fn ignore_stop_signals(command: &mut Command) {
    let ignore = || {
        for signal in [libc::SIGINT, libc::SIGTERM] {
            // SAFETY: `signal` is async-signal-safe and sets a disposition of this process only.
            if unsafe { libc::signal(signal, libc::SIG_IGN) } == libc::SIG_ERR {
                return Err(std::io::Error::last_os_error());
            }
        }
        Ok(())
    };
    // SAFETY: between `fork` and `exec` the closure only calls `signal`, and allocates nothing.
    unsafe { command.pre_exec(ignore) };
}
