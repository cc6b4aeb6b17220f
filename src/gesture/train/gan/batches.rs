//! Batches read ahead: while a step is at work, a thread of its own makes the batch of the next one. What a batch holds
//! depends on its step alone.

use super::windows::WindowBatch;
use anyhow::{Context, Result};
use rayon::ThreadPoolBuilder;
use std::sync::mpsc::{self, Receiver, Sender};

/// The batch of a step.
pub type BatchOfStep<'a> = &'a (dyn Fn(usize) -> Result<WindowBatch> + Sync);

/// Batches of one step after the other.
pub struct BatchesAhead<'a> {
    batch: BatchOfStep<'a>,
    /// Steps of the training: behind the last nothing is read ahead.
    n_steps: usize,
    ask: Sender<usize>,
    made: Receiver<(usize, Result<WindowBatch>)>,
    /// The step whose batch is under way.
    ahead: Option<usize>,
}

impl BatchesAhead<'_> {
    /// The batch of `step`; that of the next one is begun.
    ///
    /// # Errors
    /// Those of the reading.
    pub fn take(&mut self, step: usize) -> Result<WindowBatch> {
        let made = match self.ahead.take() {
            Some(ahead) => Some(self.made.recv().context("the thread that reads batches is lost")?)
                .filter(|_| ahead == step)
                .map(|(_, batch)| batch),
            None => None,
        };
        let batch = made.unwrap_or_else(|| (self.batch)(step))?;
        if step + 1 < self.n_steps && self.ask.send(step + 1).is_ok() {
            self.ahead = Some(step + 1);
        }
        Ok(batch)
    }
}

/// Calls `work` with the batches that `batch` makes, of a training of `n_steps`.
///
/// # Errors
/// No thread can be started; those of `work`.
pub fn read_ahead<R>(
    n_steps: usize,
    batch: BatchOfStep,
    work: impl FnOnce(&mut BatchesAhead) -> Result<R>,
) -> Result<R> {
    // One thread: all others are at work on the step.
    let reader = ThreadPoolBuilder::new().num_threads(1).build().context("no thread to read batches")?;
    std::thread::scope(|scope| {
        let (ask, asked) = mpsc::channel();
        let (give, made) = mpsc::channel();
        scope.spawn(move || {
            for step in asked {
                if give.send((step, reader.install(|| batch(step)))).is_err() {
                    break;
                }
            }
        });
        work(&mut BatchesAhead { batch, n_steps, ask, made, ahead: None })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use candle_core::{Device, Tensor};
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn every_step_gets_its_own_batch_and_none_behind_the_last_is_made() {
        let most = AtomicUsize::new(0);
        let batch = |step: usize| -> Result<WindowBatch> {
            most.fetch_max(step, Ordering::Relaxed);
            anyhow::ensure!(step != 6, "step 6 cannot be read");
            let tensor = || Tensor::full(step as f32, 1, &Device::Cpu);
            Ok(WindowBatch { mels: tensor()?, poses: tensor()?, mask: tensor()?, speakers: vec![step as u32] })
        };
        let taken = read_ahead(10, &batch, |batches| {
            // A step may come again, or be passed over.
            [0, 1, 2, 2, 3, 5].into_iter().map(|step| Ok(batches.take(step)?.speakers[0])).collect::<Result<Vec<u32>>>()
        });
        assert_eq!(taken.unwrap(), [0, 1, 2, 2, 3, 5]);
        let failed = read_ahead(10, &batch, |batches| batches.take(5).and_then(|_| batches.take(6)).map(drop));
        assert_eq!(failed.unwrap_err().to_string(), "step 6 cannot be read");
        read_ahead(10, &batch, |batches| batches.take(9).map(drop)).unwrap();
        assert_eq!(most.load(Ordering::Relaxed), 9);
    }
}
