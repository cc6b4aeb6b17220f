//! Batch prefetching: while a step runs, a separate thread reads the batch of the next step. The contents of a batch
//! depend only on its step.

use super::windows::WindowBatch;
use anyhow::{Context, Result};
use rayon::ThreadPoolBuilder;
use std::sync::mpsc::{self, Receiver, Sender};

pub type BatchOfStep<'a> = &'a (dyn Fn(usize) -> Result<WindowBatch> + Sync);

/// Batches of consecutive steps, prefetched by one step.
pub struct BatchPrefetcher<'a> {
    batch: BatchOfStep<'a>,
    /// Steps of the training; nothing is prefetched after the last.
    n_steps: usize,
    requests: Sender<usize>,
    results: Receiver<(usize, Result<WindowBatch>)>,
    /// Step whose batch is being prefetched.
    pending: Option<usize>,
}

impl BatchPrefetcher<'_> {
    /// Returns the batch of `step`, and starts to prefetch that of the next step.
    pub fn take(&mut self, step: usize) -> Result<WindowBatch> {
        let prefetched = match self.pending.take() {
            Some(pending) => Some(self.results.recv().context("the thread that loads batches has stopped")?)
                .filter(|_| pending == step)
                .map(|(_, batch)| batch),
            None => None,
        };
        let batch = prefetched.unwrap_or_else(|| (self.batch)(step))?;
        if step + 1 < self.n_steps && self.requests.send(step + 1).is_ok() {
            self.pending = Some(step + 1);
        }
        Ok(batch)
    }
}

/// Calls `work` with prefetched batches, which `batch` reads, of a training of `n_steps`.
pub fn prefetch<R>(
    n_steps: usize,
    batch: BatchOfStep,
    work: impl FnOnce(&mut BatchPrefetcher) -> Result<R>,
) -> Result<R> {
    // One reader thread, since the others are busy with the step.
    let reader =
        ThreadPoolBuilder::new().num_threads(1).build().context("cannot start the thread that loads batches")?;
    std::thread::scope(|scope| {
        let (requests, requested) = mpsc::channel();
        let (sender, results) = mpsc::channel();
        scope.spawn(move || {
            for step in requested {
                if sender.send((step, reader.install(|| batch(step)))).is_err() {
                    break;
                }
            }
        });
        work(&mut BatchPrefetcher { batch, n_steps, requests, results, pending: None })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use candle_core::{Device, Tensor};
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn every_step_gets_its_own_batch_and_none_is_read_after_the_last() {
        let last = AtomicUsize::new(0);
        let batch = |step: usize| -> Result<WindowBatch> {
            last.fetch_max(step, Ordering::Relaxed);
            anyhow::ensure!(step != 6, "step 6 cannot be read");
            let tensor = || Tensor::full(step as f32, 1, &Device::Cpu);
            Ok(WindowBatch { mels: tensor()?, poses: tensor()?, mask: tensor()?, speakers: vec![step as u32] })
        };
        let taken = prefetch(10, &batch, |batches| {
            // A step may be repeated or skipped.
            [0, 1, 2, 2, 3, 5].into_iter().map(|step| Ok(batches.take(step)?.speakers[0])).collect::<Result<Vec<u32>>>()
        });
        assert_eq!(taken.unwrap(), [0, 1, 2, 2, 3, 5]);
        let failed = prefetch(10, &batch, |batches| batches.take(5).and_then(|_| batches.take(6)).map(drop));
        assert_eq!(failed.unwrap_err().to_string(), "step 6 cannot be read");
        prefetch(10, &batch, |batches| batches.take(9).map(drop)).unwrap();
        assert_eq!(last.load(Ordering::Relaxed), 9);
    }
}
