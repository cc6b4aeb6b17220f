//! How much there is to learn from.

use orator_dataset::{Dataset, Split};

/// Speech of a dataset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainingMaterial {
    /// Seconds to train on, in intervals that hold a window.
    pub train_secs: f64,
    /// Seconds held out for validation, likewise.
    pub validation_secs: f64,
    /// Speakers, a dataset each; at least 1.
    pub n_speakers: usize,
}

impl TrainingMaterial {
    /// Seconds of datasets in intervals of `window_frames` at least.
    pub fn measure(datasets: &[&Dataset], window_frames: usize) -> Self {
        let of_dataset = |dataset: &Dataset, split: Split| -> f64 {
            let fps = dataset.info().fps;
            let samples = dataset.samples(split).into_iter();
            samples.filter(|sample| sample.n_frames >= window_frames).map(|sample| fps.secs(sample.n_frames)).sum()
        };
        let secs = |split: Split| datasets.iter().map(|dataset| of_dataset(dataset, split)).sum();
        Self {
            train_secs: secs(Split::Train),
            validation_secs: secs(Split::Validation),
            n_speakers: datasets.len().max(1),
        }
    }

    /// Minutes to train on.
    pub fn minutes(&self) -> f64 {
        self.train_secs / 60.0
    }
}
