//! The intervals of a split as rows of numbers: held in memory where they are few, read from the shards for every window
//! where they are many, so that memory does not grow with the dataset. Both give the same numbers.

use crate::generate::mel_stream::mel_frames;
use crate::generate::normalisation::Normalisation;
use anyhow::Result;
use ndarray::Array2;
use orator_base::audio::mel;
use orator_base::motion::bones;
use orator_dataset::Dataset;
use orator_dataset::index::SampleRef;
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;

/// Some frames of an interval.
#[derive(Clone)]
pub struct IntervalRows {
    /// [numbers, T]: 144 and those of the channels.
    pub features: Array2<f32>,
    /// [48 + 3 x channels, T]: whether the joint (all but the neck), or the angle, is to be learnt there.
    pub mask: Array2<bool>,
    /// [64, mel frames]
    pub mels: Array2<f32>,
    /// Place of the first frame, and of the first of the spectrogram, in the interval.
    pub first_frame: usize,
    pub first_mel: usize,
}

/// The intervals of a split.
pub struct TrainingIntervals<'d> {
    dataset: &'d Dataset,
    samples: Vec<SampleRef>,
    normal: Normalisation,
    /// All of them, where they are few.
    held: Option<Vec<IntervalRows>>,
}

impl<'d> TrainingIntervals<'d> {
    /// The intervals of these samples, in memory if they take no more than `most_bytes`.
    ///
    /// # Errors
    /// A sample that is damaged; of those that stay in the shards it is found when it is read.
    pub fn open(
        dataset: &'d Dataset,
        samples: Vec<SampleRef>,
        normal: &Normalisation,
        most_bytes: usize,
    ) -> Result<Self> {
        let mut intervals = Self { dataset, samples, normal: normal.clone(), held: None };
        let bytes = |i| intervals.n_frames(i) * 5 * normal.n_numbers() + intervals.n_mels(i) * 4 * mel::N_MELS;
        if (0..intervals.n_intervals()).map(bytes).sum::<usize>() <= most_bytes {
            let whole = |i| {
                // Looks whether the sample is as it was written.
                intervals.dataset.read(&intervals.samples[i])?;
                intervals.read(i, 0..intervals.n_frames(i), 0..intervals.n_mels(i))
            };
            intervals.held = Some((0..intervals.n_intervals()).into_par_iter().map(whole).collect::<Result<_>>()?);
        }
        Ok(intervals)
    }

    /// Number of intervals.
    pub fn n_intervals(&self) -> usize {
        self.samples.len()
    }

    /// Number of frames of an interval.
    pub fn n_frames(&self, interval: usize) -> usize {
        self.samples[interval].n_frames
    }

    /// Number of spectrogram frames of an interval: at least those of its motion.
    pub fn n_mels(&self, interval: usize) -> usize {
        let sample = &self.samples[interval];
        // Rounding may ask for one spectrogram frame more than the sound has windows for.
        let enough = mel::n_samples(mel_frames(self.dataset.info().fps, sample.n_frames) + 1);
        mel::n_frames(enough.max(sample.n_sound_samples()))
    }

    /// Rows that hold these frames, and these of the spectrogram; maybe more.
    pub fn rows(&self, interval: usize, frames: Range<usize>, mels: Range<usize>) -> Result<Cow<'_, IntervalRows>> {
        Ok(match &self.held {
            Some(held) => Cow::Borrowed(&held[interval]),
            None => Cow::Owned(self.read(interval, frames, mels)?),
        })
    }

    fn read(&self, interval: usize, frames: Range<usize>, mels: Range<usize>) -> Result<IntervalRows> {
        let sample = &self.samples[interval];
        let (first_frame, first_mel) = (frames.start, mels.start);
        let mut motion = self.dataset.motion(sample, frames.clone())?;
        // Every video has its own constant lengths; the generator learns one body.
        bones::with_lengths(&mut motion, &self.normal.lengths());
        let posture = if self.normal.channels.is_empty() { None } else { self.dataset.posture(sample, frames)? };
        let (features, mask) = self.normal.features_with_channels(&motion, posture.as_ref());
        let start = mels.start * mel::HOP;
        let n_samples = mel::n_samples(mels.len());
        let there = sample.n_sound_samples();
        let mut samples = self.dataset.sound(sample, start.min(there)..(start + n_samples).min(there))?.samples;
        samples.resize(n_samples, 0.0);
        let mels = mel::log_mel(&samples).reversed_axes().as_standard_layout().into_owned();
        Ok(IntervalRows { features, mask, mels, first_frame, first_mel })
    }
}
