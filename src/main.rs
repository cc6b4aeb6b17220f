//! The `orator` program: parse, run the verb, print the error, set the exit code.

#![cfg_attr(not(test), deny(clippy::print_stderr))]

mod cli;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

unsafe extern "C" {
    /// The allocator's: sets an option.
    fn mi_option_set(option: std::ffi::c_int, value: std::ffi::c_long);
}

/// After so many milliseconds the allocator gives freed memory back to the system; -1 is never.
const PURGE_DELAY: std::ffi::c_int = 15;

fn main() -> std::process::ExitCode {
    // A training step takes and frees the same gigabytes over and over; fresh pages cost more than all its norms.
    // SAFETY: an option of the allocator that is linked above, by its number in its header.
    unsafe { mi_option_set(PURGE_DELAY, -1) };
    // ONNX Runtime reports its use to its maker unless this is set before it is loaded.
    // SAFETY: no other thread has been started yet.
    unsafe { std::env::set_var(orator::external::onnx::TELEMETRY_OFF, "1") };
    // The tensor library's own threads spin while they wait, which costs more than they help beside rayon's.
    if std::env::var_os("CANDLE_NUM_THREADS").is_none() {
        // SAFETY: no other thread has been started yet.
        unsafe { std::env::set_var("CANDLE_NUM_THREADS", "1") };
    }
    cli::main()
}
