//! The most memory that processes started by this one have had.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Time between two looks.
const EVERY: Duration = Duration::from_millis(100);

/// Looks at the processes from its beginning to its end.
pub struct MemoryWatch {
    over: Arc<AtomicBool>,
    thread: JoinHandle<f64>,
}

impl MemoryWatch {
    /// Begins to look.
    pub fn begin() -> Self {
        let over = Arc::new(AtomicBool::new(false));
        let ended = over.clone();
        let thread = std::thread::spawn(move || {
            let mut peak = 0.0f64;
            while !ended.load(Ordering::Relaxed) {
                peak = peaks().fold(peak, f64::max);
                std::thread::sleep(EVERY);
            }
            peak
        });
        Self { over, thread }
    }

    /// The most memory of one process, MiB; none where there was none, or the system does not say.
    pub fn end(self) -> Option<f64> {
        self.over.store(true, Ordering::Relaxed);
        self.thread.join().ok().filter(|peak| *peak > 0.0)
    }
}

/// Peak of each process that this one has started, MiB, while it lives.
fn peaks() -> impl Iterator<Item = f64> {
    let own = std::process::id();
    let processes = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    processes.filter_map(move |process| {
        let status = std::fs::read_to_string(process.path().join("status")).ok()?;
        let number = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name))?;
            line.split_whitespace().next()?.parse::<f64>().ok()
        };
        (number("PPid:")? == f64::from(own)).then(|| number("VmHWM:")).flatten().map(|kib| kib / 1024.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_that_takes_memory_is_seen() {
        let watch = MemoryWatch::begin();
        let mut child = std::process::Command::new("sleep").arg("0.5").spawn().unwrap();
        child.wait().unwrap();
        // Other tests start processes too: there is no upper bound.
        assert!(cfg!(not(target_os = "linux")) || watch.end().is_some_and(|mib| mib >= 0.3));
    }
}
