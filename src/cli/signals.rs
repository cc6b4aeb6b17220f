//! Ctrl-C and SIGTERM: a verb either exits at once and reports what is saved, or is asked to stop at a point from which
//! it can continue and exits at once on the second signal.

use super::ui::note;
use std::sync::atomic::{AtomicU8, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock};
use tokio::runtime::{Builder, Runtime};
use tokio::signal::unix::{SignalKind, signal};

/// Runtime that receives signals. It uses a socket pair, which a restricted process can no longer open.
static RUNTIME: LazyLock<Option<Runtime>> = LazyLock::new(|| Builder::new_current_thread().enable_all().build().ok());

/// Number of calls of `on_signal`; the handler of the last one is active.
static N_HANDLERS: AtomicUsize = AtomicUsize::new(0);

/// Opens the resources for signals without starting a thread. Call this before the process is restricted.
pub fn prepare() {
    LazyLock::force(&RUNTIME);
}

/// Ignores Ctrl-C and SIGTERM from now on, without starting a thread. This is for a process that exits together with
/// its parent: terminals and schedulers signal both, and the parent decides what to finish first.
pub fn ignore_signals() {
    let Some(runtime) = &*RUNTIME else { return };
    let _guard = runtime.enter();
    // Registering a handler once disables the default action of a signal permanently.
    let _ = (signal(SignalKind::interrupt()), signal(SignalKind::terminate()));
}

/// From now on, Ctrl-C or SIGTERM exits the program (code 130 or 143) and prints `saved`: what is saved and how to
/// continue.
pub fn exit_on_signal(saved: &'static str) {
    on_signal(move |code| end(code, saved));
}

/// Whether a stop was requested by Ctrl-C or SIGTERM.
#[derive(Clone, Default)]
pub struct StopRequest {
    /// Exit code; 0 if no stop was requested.
    code: Arc<AtomicU8>,
}

impl StopRequest {
    /// From now on, the first signal is a stop request and prints `first`; the second exits the program and prints
    /// `saved`.
    pub fn listen(&self, first: &'static str, saved: &'static str) {
        let requested = self.code.clone();
        on_signal(move |code| match requested.swap(code, Ordering::Relaxed) {
            0 => note(&format!("\n{first}")),
            _ => end(code, saved),
        });
    }

    /// Exit code of a program that stops on request; `None` without a request.
    pub fn code(&self) -> Option<u8> {
        Some(self.code.load(Ordering::Relaxed)).filter(|code| *code > 0)
    }
}

fn end(code: u8, saved: &str) {
    note(&format!("\nstopped; {saved}"));
    std::process::exit(i32::from(code));
}

/// Calls `handler`, which replaces that of an earlier call, with the exit code of each signal, on a separate thread. If
/// signals cannot be received, they exit the program by default.
fn on_signal(mut handler: impl FnMut(u8) + Send + 'static) {
    let Some(runtime) = &*RUNTIME else { return };
    let guard = runtime.enter();
    let (interrupt, terminate) = (signal(SignalKind::interrupt()), signal(SignalKind::terminate()));
    drop(guard);
    let (Ok(mut interrupt), Ok(mut terminate)) = (interrupt, terminate) else { return };
    let number = N_HANDLERS.fetch_add(1, Ordering::Relaxed) + 1;
    std::thread::spawn(move || {
        runtime.block_on(async {
            loop {
                // 128 plus the signal number, as in shells.
                let code = tokio::select! {
                    _ = interrupt.recv() => 130,
                    _ = terminate.recv() => 143,
                };
                if number != N_HANDLERS.load(Ordering::Relaxed) {
                    break;
                }
                handler(code);
            }
        });
    });
}
