//! Parallel loops for the operators of this crate, by default on rayon's threads. A training step consists of some
//! hundred small loops, and a thread that falls asleep between two of them wakes too late for the next, on a shared
//! machine by a time slice. Training therefore uses a pool of spinning threads, as other frameworks do. Results do not
//! depend on which thread runs a task.

use rayon::prelude::*;
use std::cell::{Cell, UnsafeCell};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::Ordering::SeqCst;
use std::sync::atomic::{AtomicBool, AtomicUsize};
use std::sync::{Mutex, OnceLock};

/// Work of the pool, called with the number of a chunk; valid until `SpinPool::run` returns.
type PoolTask = *const (dyn Fn(usize) + Sync);

struct SpinPool {
    /// Written only by the leader, while `closed` is set and `active` is 0.
    work: UnsafeCell<Option<(PoolTask, usize)>>,
    next: AtomicUsize,
    /// Number of helpers that may be reading `work`.
    active: AtomicUsize,
    closed: AtomicBool,
    failed: AtomicBool,
    ended: AtomicBool,
}

// SAFETY: access to `work` is synchronised by `closed` and `active`, as documented there.
unsafe impl Sync for SpinPool {}

thread_local!(static POOL: Cell<*const SpinPool> = const { Cell::new(std::ptr::null()) });

/// Calls `f`; its parallel loops use threads that spin until it returns.
pub fn with_spinning_workers<R>(f: impl FnOnce() -> R) -> R {
    let pool = SpinPool {
        work: UnsafeCell::new(None),
        next: AtomicUsize::new(0),
        active: AtomicUsize::new(0),
        closed: AtomicBool::new(true),
        failed: AtomicBool::new(false),
        ended: AtomicBool::new(false),
    };
    let n_helpers = rayon::current_num_threads().saturating_sub(1);
    if n_helpers == 0 || !POOL.get().is_null() {
        return f();
    }
    std::thread::scope(|scope| {
        (0..n_helpers).for_each(|_| {
            scope.spawn(|| pool.help());
        });
        POOL.set(&raw const pool);
        let result = catch_unwind(AssertUnwindSafe(f));
        POOL.set(std::ptr::null());
        pool.ended.store(true, SeqCst);
        result.unwrap_or_else(|panic| resume_unwind(panic))
    })
}

/// Calls `f` for 0..n in any order, on all available threads.
pub fn parallel_for(n: usize, f: impl Fn(usize) + Sync) {
    let pool = POOL.get();
    if n == 1 || pool.is_null() && rayon::current_num_threads() == 1 {
        return (0..n).for_each(f);
    }
    if pool.is_null() {
        return (0..n).into_par_iter().for_each(&f);
    }
    // Nested loops run on the thread of the outer chunk.
    POOL.set(std::ptr::null());
    // SAFETY: the pool outlives the period in which its leader's thread points to it.
    let result = catch_unwind(AssertUnwindSafe(|| unsafe { &*pool }.run(n, &f)));
    POOL.set(pool);
    if let Err(panic) = result {
        resume_unwind(panic);
    }
}

/// Returns the results of `f` for 0..n in order, computed on all available threads.
pub fn parallel_map<R: Send + Sync>(n: usize, f: impl Fn(usize) -> R + Sync) -> Vec<R> {
    let results: Vec<OnceLock<R>> = (0..n).map(|_| OnceLock::new()).collect();
    parallel_for(n, |i| {
        let _ = results[i].set(f(i));
    });
    results.into_iter().filter_map(OnceLock::into_inner).collect()
}

/// Returns the results of `f` for each of `items` with its index, in order, computed on all available threads.
pub fn parallel_each<I: Send, R: Send + Sync>(
    items: impl Iterator<Item = I>,
    f: impl Fn(usize, I) -> R + Sync,
) -> Vec<R> {
    let items: Vec<Mutex<Option<I>>> = items.map(|item| Mutex::new(Some(item))).collect();
    let take = |i: usize| items[i].lock().ok().and_then(|mut item| item.take());
    parallel_map(items.len(), |i| take(i).map(|item| f(i, item))).into_iter().flatten().collect()
}

impl SpinPool {
    fn run(&self, n: usize, f: &(dyn Fn(usize) + Sync)) {
        // SAFETY: only the lifetime is erased; no helper is active when this function returns.
        let work: PoolTask = unsafe { std::mem::transmute::<&(dyn Fn(usize) + Sync), PoolTask>(f) };
        // SAFETY: `closed` is set and no helper is active, since the previous run or since construction.
        unsafe { *self.work.get() = Some((work, n)) };
        self.next.store(0, SeqCst);
        self.closed.store(false, SeqCst);
        let own = catch_unwind(AssertUnwindSafe(|| self.take(f, n)));
        self.closed.store(true, SeqCst);
        let mut spin = SpinWait::default();
        while self.active.load(SeqCst) > 0 {
            spin.wait();
        }
        if let Err(panic) = own {
            resume_unwind(panic);
        }
        assert!(!self.failed.load(SeqCst), "a chunk of parallel work failed");
    }

    fn take(&self, f: &(dyn Fn(usize) + Sync), n: usize) {
        loop {
            let chunk = self.next.fetch_add(1, SeqCst);
            if chunk >= n {
                return;
            }
            f(chunk);
        }
    }

    fn help(&self) {
        let mut spin = SpinWait::default();
        while !self.ended.load(SeqCst) {
            if self.closed.load(SeqCst) {
                spin.wait();
                continue;
            }
            spin = SpinWait::default();
            self.active.fetch_add(1, SeqCst);
            // `closed` is still unset after `active` was incremented, so the leader now waits for this thread.
            if !self.closed.load(SeqCst) {
                // SAFETY: the leader writes only while no helper is active.
                if let Some((work, n)) = unsafe { *self.work.get() } {
                    // SAFETY: the work is valid until the leader has seen that no helper is active.
                    let help = AssertUnwindSafe(|| self.take(unsafe { &*work }, n));
                    if catch_unwind(help).is_err() {
                        self.failed.store(true, SeqCst);
                    }
                }
            }
            self.active.fetch_sub(1, SeqCst);
            std::hint::spin_loop();
        }
    }
}

/// Waits by spinning; after a while it yields the processor to other threads.
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
