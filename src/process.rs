//! For the process of the program and its benchmarks: how memory is kept, what libraries read from the environment.

/// Prepares the process; before it starts a thread.
pub fn prepare() {
    keep_freed_memory();
    // ONNX Runtime reports its use to its maker unless this is set before loading. SAFETY: no other thread runs yet.
    unsafe { std::env::set_var(orator_onnx::TELEMETRY_OFF, "1") };
    // The tensor library's own threads spin while they wait, which costs more than they help beside rayon's.
    if std::env::var_os("CANDLE_NUM_THREADS").is_none() {
        // SAFETY: no other thread has been started yet.
        unsafe { std::env::set_var("CANDLE_NUM_THREADS", "1") };
    }
}

/// A training step takes and frees the same blocks over and over, and as they come the allocator gives the large ones
/// back to the system every time: fresh pages cost more than all norms of the step. Kept, they cost no more memory than
/// the largest step.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn keep_freed_memory() {
    /// Bytes by which the heap grows at a time.
    const GROWTH: std::ffi::c_int = 64 << 20;
    for (option, value) in [(libc::M_MMAP_MAX, 0), (libc::M_TRIM_THRESHOLD, -1), (libc::M_TOP_PAD, GROWTH)] {
        // SAFETY: options of the C library's allocator, each with a value that its manual allows.
        unsafe { libc::mallopt(option, value) };
    }
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn keep_freed_memory() {}
