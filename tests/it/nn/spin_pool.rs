//! Threads that wait for short tasks.

use orator_nn::cpu::spin_pool::{parallel_for, with_spinning_workers};
use std::panic::catch_unwind;
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::SeqCst;

fn with_threads<R: Send>(n: usize, f: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(f)
}

#[test]
fn every_chunk_runs_once() {
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
fn a_panicking_chunk_is_reported_and_the_threads_end() {
    let failing = || with_spinning_workers(|| parallel_for(100, |i| assert!(i != 50, "chunk 50")));
    assert!(with_threads(3, || catch_unwind(failing)).is_err());
}
