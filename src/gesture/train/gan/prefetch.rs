//! Batches of the next steps, read by other threads while a step runs.

use anyhow::{Context, Result};
use rayon::{Scope, ThreadPoolBuilder};
use std::collections::VecDeque;
use std::sync::mpsc::{self, Receiver};

/// Function that reads the batch of a step, in any thread.
pub(super) type BatchOfStep<'a, B> = &'a (dyn Fn(usize) -> Result<B> + Sync);

/// Batches of the next steps, in the order of the steps.
pub(super) struct BatchPrefetcher<'a, 'b, B> {
    batch: BatchOfStep<'b, B>,
    scope: &'a Scope<'b>,
    /// Steps of the training; nothing is prefetched after the last.
    n_steps: usize,
    /// Number of batches that are read at a time.
    n_readers: usize,
    pending: VecDeque<(usize, Receiver<Result<B>>)>,
}

impl<'b, B: Send + 'b> BatchPrefetcher<'_, 'b, B> {
    /// Returns the batch of `step`, and starts to prefetch those of the next steps.
    pub(super) fn take(&mut self, step: usize) -> Result<B> {
        let prefetched = self.pending.pop_front().filter(|(pending, _)| *pending == step);
        let batch = match prefetched {
            Some((_, batch)) => batch.recv().context("the thread that loads batches has stopped")?,
            None => {
                self.pending.clear();
                (self.batch)(step)
            }
        }?;
        for next in step + 1 + self.pending.len()..self.n_steps.min(step + 1 + self.n_readers) {
            let ((sender, receiver), batch) = (mpsc::channel(), self.batch);
            self.scope.spawn(move |_| {
                let _ = sender.send(batch(next));
            });
            self.pending.push_back((next, receiver));
        }
        Ok(batch)
    }
}

/// Calls `work` with the batches of a training of `n_steps`, which `batch` reads in `n_readers` threads.
pub(super) fn prefetch<R: Send, B: Send>(
    n_steps: usize,
    n_readers: usize,
    batch: BatchOfStep<B>,
    work: impl FnOnce(&mut BatchPrefetcher<B>) -> Result<R>,
) -> Result<R> {
    let readers = ThreadPoolBuilder::new().num_threads(n_readers).build();
    let readers = readers.context("cannot start the threads that load batches")?;
    readers.in_place_scope(|scope| {
        work(&mut BatchPrefetcher { batch, scope, n_steps, n_readers, pending: VecDeque::new() })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn every_step_gets_its_own_batch_and_none_is_read_after_the_last() {
        let last = AtomicUsize::new(0);
        let batch = |step: usize| -> Result<usize> {
            last.fetch_max(step, Ordering::Relaxed);
            anyhow::ensure!(step != 6, "step 6 cannot be read");
            Ok(step)
        };
        for n_readers in [1, 3] {
            let taken = prefetch(10, n_readers, &batch, |batches| {
                // A step may be repeated or skipped.
                [0, 1, 2, 2, 3, 5].into_iter().map(|step| batches.take(step)).collect::<Result<Vec<_>>>()
            });
            assert_eq!(taken.unwrap(), [0, 1, 2, 2, 3, 5]);
            let failed =
                prefetch(10, n_readers, &batch, |batches| batches.take(5).and_then(|_| batches.take(6)).map(drop));
            assert_eq!(failed.unwrap_err().to_string(), "step 6 cannot be read");
            prefetch(10, n_readers, &batch, |batches| batches.take(9).map(drop)).unwrap();
            assert_eq!(last.load(Ordering::Relaxed), 9);
        }
    }
}
