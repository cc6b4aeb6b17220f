//! Parallel pieces of work for this room's operators. By themselves they run on rayon's threads. A training step is some
//! hundred small ones, though, and a thread that falls asleep between two of them comes too late to the next, on a
//! shared machine by a time slice; so a training keeps a team of threads that look for work all the time, as those of
//! other frameworks do. Who does a piece never changes what it gives.

use rayon::prelude::*;
use std::cell::{Cell, UnsafeCell};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst};
use std::sync::{Mutex, OnceLock};

/// A piece's work by its number, as the team sees it: alive as long as `ThreadTeam::run` has not returned.
type TeamTask = *const (dyn Fn(usize) + Sync);

struct ThreadTeam {
    /// Written by the leader alone, while it is closed and nobody is active.
    work: UnsafeCell<Option<(TeamTask, usize)>>,
    next: AtomicUsize,
    /// Helpers that may be reading `work`.
    active: AtomicUsize,
    closed: AtomicBool,
    broken: AtomicBool,
    over: AtomicBool,
}

// SAFETY: `work` is guarded by `closed` and `active` as said there.
unsafe impl Sync for ThreadTeam {}

thread_local!(static TEAM: Cell<*const ThreadTeam> = const { Cell::new(std::ptr::null()) });

/// Runs `f`, whose parallel pieces are shared out among threads that stay awake until it returns.
pub fn with_spinning_workers<R>(f: impl FnOnce() -> R) -> R {
    let team = ThreadTeam {
        work: UnsafeCell::new(None),
        next: AtomicUsize::new(0),
        active: AtomicUsize::new(0),
        closed: AtomicBool::new(true),
        broken: AtomicBool::new(false),
        over: AtomicBool::new(false),
    };
    let n_helpers = rayon::current_num_threads().saturating_sub(1);
    if n_helpers == 0 || !TEAM.get().is_null() {
        return f();
    }
    std::thread::scope(|scope| {
        (0..n_helpers).for_each(|_| {
            scope.spawn(|| team.help());
        });
        TEAM.set(&raw const team);
        let result = catch_unwind(AssertUnwindSafe(f));
        TEAM.set(std::ptr::null());
        team.over.store(true, SeqCst);
        result.unwrap_or_else(|panic| resume_unwind(panic))
    })
}

/// Runs `f` for 0..n, on all threads at hand, in any order.
pub fn parallel_for(n: usize, f: impl Fn(usize) + Sync) {
    let team = TEAM.get();
    if team.is_null() {
        return (0..n).into_par_iter().for_each(&f);
    }
    // Pieces of pieces are the business of the thread that has them.
    TEAM.set(std::ptr::null());
    // SAFETY: a team outlives the time for which its leader's thread points to it.
    let result = catch_unwind(AssertUnwindSafe(|| unsafe { &*team }.run(n, &f)));
    TEAM.set(team);
    if let Err(panic) = result {
        resume_unwind(panic);
    }
}

/// What `f` gives for 0..n, in this order, worked out on all threads at hand.
pub fn parallel_map<R: Send + Sync>(n: usize, f: impl Fn(usize) -> R + Sync) -> Vec<R> {
    let results: Vec<OnceLock<R>> = (0..n).map(|_| OnceLock::new()).collect();
    parallel_for(n, |i| {
        let _ = results[i].set(f(i));
    });
    results.into_iter().filter_map(OnceLock::into_inner).collect()
}

/// What `f` gives for each of `items` with its number, in their order, worked out on all threads at hand.
pub fn parallel_each<I: Send, R: Send + Sync>(
    items: impl Iterator<Item = I>,
    f: impl Fn(usize, I) -> R + Sync,
) -> Vec<R> {
    let items: Vec<Mutex<Option<I>>> = items.map(|item| Mutex::new(Some(item))).collect();
    let take = |i: usize| items[i].lock().ok().and_then(|mut item| item.take());
    parallel_map(items.len(), |i| take(i).map(|item| f(i, item))).into_iter().flatten().collect()
}

impl ThreadTeam {
    fn run(&self, n: usize, f: &(dyn Fn(usize) + Sync)) {
        // SAFETY: only the lifetime is forgotten; nobody is active when this function returns.
        let work: TeamTask = unsafe { std::mem::transmute::<&(dyn Fn(usize) + Sync), TeamTask>(f) };
        // SAFETY: closed, and nobody active: since the last run, or from the beginning.
        unsafe { *self.work.get() = Some((work, n)) };
        self.next.store(0, SeqCst);
        self.closed.store(false, SeqCst);
        let own = catch_unwind(AssertUnwindSafe(|| self.take(f, n)));
        self.closed.store(true, SeqCst);
        let mut patience = SpinWait::default();
        while self.active.load(SeqCst) > 0 {
            patience.wait();
        }
        if let Err(panic) = own {
            resume_unwind(panic);
        }
        assert!(!self.broken.load(SeqCst), "a piece of parallel work failed");
    }

    fn take(&self, f: &(dyn Fn(usize) + Sync), n: usize) {
        loop {
            let piece = self.next.fetch_add(1, SeqCst);
            if piece >= n {
                return;
            }
            f(piece);
        }
    }

    fn help(&self) {
        let mut patience = SpinWait::default();
        while !self.over.load(SeqCst) {
            if self.closed.load(SeqCst) {
                patience.wait();
                continue;
            }
            patience = SpinWait::default();
            self.active.fetch_add(1, SeqCst);
            // Seen open while active: the leader waits for us from here on.
            if !self.closed.load(SeqCst) {
                // SAFETY: the leader writes only while nobody is active.
                if let Some((work, n)) = unsafe { *self.work.get() } {
                    // SAFETY: the work lives until the leader has seen that nobody is active.
                    let help = AssertUnwindSafe(|| self.take(unsafe { &*work }, n));
                    if catch_unwind(help).is_err() {
                        self.broken.store(true, SeqCst);
                    }
                }
            }
            self.active.fetch_sub(1, SeqCst);
            std::hint::spin_loop();
        }
    }
}

/// Waits awake; where it takes long, whoever else wants the processor gets it.
#[derive(Default)]
struct SpinWait {
    n_spins: u32,
}

impl SpinWait {
    fn wait(&mut self) {
        if self.n_spins < 1 << 12 {
            self.n_spins += 1;
            std::hint::spin_loop();
        } else {
            std::thread::yield_now();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_threads<R: Send>(n: usize, f: impl FnOnce() -> R + Send) -> R {
        rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(f)
    }

    #[test]
    fn every_piece_is_done_once() {
        for n_threads in [1, 3] {
            with_threads(n_threads, || {
                with_spinning_workers(|| {
                    for n in (0..200).chain([10_000]) {
                        let done: Vec<AtomicUsize> = (0..n).map(|_| AtomicUsize::new(0)).collect();
                        parallel_for(n, |i| {
                            done[i].fetch_add(1, SeqCst);
                        });
                        assert!(done.iter().all(|done| done.load(SeqCst) == 1));
                    }
                });
            });
        }
    }

    #[test]
    fn a_piece_that_fails_is_told_and_the_threads_are_let_go() {
        let failing = || with_spinning_workers(|| parallel_for(100, |i| assert!(i != 50, "piece 50")));
        assert!(with_threads(3, || catch_unwind(failing)).is_err());
    }
}
