//! Ctrl-C and SIGTERM: work ends at once and says what is kept, or is asked to end where it can go on from, and at once
//! when asked again.

use super::ui::note;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, LazyLock};
use tokio::runtime::{Builder, Runtime};
use tokio::signal::unix::{SignalKind, signal};

/// Where signals arrive: a pair of sockets, which a restricted program cannot open any more.
static RUNTIME: LazyLock<Option<Runtime>> = LazyLock::new(|| Builder::new_current_thread().enable_all().build().ok());

/// Opens what signals need. It comes before the program is restricted, and starts no thread.
pub fn prepare() {
    LazyLock::force(&RUNTIME);
}

/// From here on Ctrl-C and SIGTERM do nothing. For a process that ends with the one that started it: terminals and schedulers
/// send them to both, and the other one decides what is finished first. It starts no thread.
pub fn leave_to_parent() {
    let Some(runtime) = &*RUNTIME else { return };
    let _guard = runtime.enter();
    // A signal that was listened for once has lost its own effect for good.
    let _ = (signal(SignalKind::interrupt()), signal(SignalKind::terminate()));
}

/// From here on Ctrl-C or SIGTERM ends the program (exit code 130 or 143) and says what is kept: `kept`, and how to go on.
pub fn tell_when_stopped(kept: &'static str) {
    listen(move |code| end(code, kept));
}

/// Whether an end was asked for, by Ctrl-C or SIGTERM.
#[derive(Clone, Default)]
pub struct StopRequest {
    /// Exit code; 0: nothing was asked.
    code: Arc<AtomicU8>,
}

impl StopRequest {
    /// From here on the first signal is a request, of which `first` is said; the second ends the program and says `kept`.
    pub fn listen(&self, first: &'static str, kept: &'static str) {
        let asked = self.code.clone();
        listen(move |code| match asked.swap(code, Ordering::Relaxed) {
            0 => note(&format!("\n{first}")),
            _ => end(code, kept),
        });
    }

    /// Exit code of a program that ends by request.
    pub fn code(&self) -> Option<u8> {
        Some(self.code.load(Ordering::Relaxed)).filter(|code| *code > 0)
    }
}

fn end(code: u8, kept: &str) {
    note(&format!("\nstopped; {kept}"));
    std::process::exit(i32::from(code));
}

/// Calls with the exit code of each signal, from a thread of its own. Where there can be none, a signal ends the program
/// as it does by default.
fn listen(mut called: impl FnMut(u8) + Send + 'static) {
    let Some(runtime) = &*RUNTIME else { return };
    let guard = runtime.enter();
    let (interrupt, terminate) = (signal(SignalKind::interrupt()), signal(SignalKind::terminate()));
    drop(guard);
    let (Ok(mut interrupt), Ok(mut terminate)) = (interrupt, terminate) else { return };
    std::thread::spawn(move || {
        runtime.block_on(async {
            loop {
                // 128 and the signal's number, as shells have it.
                called(tokio::select! {
                    _ = interrupt.recv() => 130,
                    _ = terminate.recv() => 143,
                });
            }
        });
    });
}
