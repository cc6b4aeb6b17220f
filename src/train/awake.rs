//! All cores kept ready while a training runs. A step is some hundred small pieces of parallel work; a thread that falls
//! asleep between two of them is woken too late to be of use, and on a shared machine does not come back at all for a
//! while. So the pool's other threads look for work all the time, as those of other frameworks do.

use std::sync::atomic::{AtomicBool, Ordering};

/// Runs `f` on a thread of the pool, with the others awake until it returns.
pub fn awake<R: Send>(f: impl FnOnce() -> R + Send) -> R {
    /// Lets the others go also when `f` panics.
    struct Done<'a>(&'a AtomicBool);
    impl Drop for Done<'_> {
        fn drop(&mut self) {
            self.0.store(true, Ordering::Relaxed);
        }
    }
    let done = AtomicBool::new(false);
    rayon::scope(|scope| {
        let own = rayon::current_thread_index();
        let done = &done;
        scope.spawn_broadcast(move |_, thread| {
            while Some(thread.index()) != own && !done.load(Ordering::Relaxed) {
                if rayon::yield_now() != Some(rayon::Yield::Executed) {
                    std::hint::spin_loop();
                }
            }
        });
        let _done = Done(done);
        f()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    #[test]
    fn work_is_done_and_the_others_are_let_go() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let sum = pool.install(|| awake(|| (0..1000u64).into_par_iter().sum::<u64>()));
        assert_eq!(sum, 499_500);
        assert_eq!(pool.install(|| awake(rayon::current_num_threads)), 3);
        let failing = std::panic::AssertUnwindSafe(|| pool.install(|| awake(|| panic!("a step that fails"))));
        assert!(std::panic::catch_unwind(failing).is_err());
    }
}
