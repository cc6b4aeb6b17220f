//! Features and spectrograms of the intervals of a split. Small splits are cached in memory; large ones are read from
//! the shards for every window, so that memory does not grow with the dataset. Both ways return the same values.

use crate::generate::generator::mel_frames;
use crate::generate::normalisation::Normalisation;
use crate::generate::seq2seq::architecture::{NumberedWord, Vocabulary};
use anyhow::Result;
use ndarray::Array2;
use orator_base::audio::mel;
use orator_base::motion::bones;
use orator_dataset::Dataset;
use orator_dataset::index::SampleRef;
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;

/// Features of a range of frames of an interval.
#[derive(Clone)]
pub struct IntervalRows {
    /// [features, T]: 144 of the joints, then those of the posture channels.
    pub features: Array2<f32>,
    /// [48 + 3 x channels, T]: whether the joint (all but the neck), or the angle, is known and trained on.
    pub mask: Array2<bool>,
    /// [64, mel frames]
    pub mels: Array2<f32>,
    /// Index in the interval of the first frame of motion.
    pub first_frame: usize,
    /// Index in the interval of the first spectrogram frame.
    pub first_mel: usize,
}

pub struct TrainingIntervals<'d> {
    dataset: &'d Dataset,
    samples: Vec<SampleRef>,
    normal: Normalisation,
    /// All intervals, if they fit into memory.
    cached: Option<Vec<IntervalRows>>,
}

impl<'d> TrainingIntervals<'d> {
    /// The intervals of these samples, cached in memory if they take at most `max_bytes`.
    ///
    /// # Errors
    /// A damaged sample; if samples are not cached, it is only found when it is read.
    pub fn open(
        dataset: &'d Dataset,
        samples: Vec<SampleRef>,
        normal: &Normalisation,
        max_bytes: usize,
    ) -> Result<Self> {
        let mut intervals = Self { dataset, samples, normal: normal.clone(), cached: None };
        let bytes = |i| intervals.n_frames(i) * 5 * normal.n_features() + intervals.n_mels(i) * 4 * mel::N_MELS;
        if (0..intervals.n_intervals()).map(bytes).sum::<usize>() <= max_bytes {
            let whole = |i| {
                // `read` verifies the checksum of the sample.
                intervals.dataset.read(&intervals.samples[i])?;
                intervals.read(i, 0..intervals.n_frames(i), 0..intervals.n_mels(i))
            };
            intervals.cached = Some((0..intervals.n_intervals()).into_par_iter().map(whole).collect::<Result<_>>()?);
        }
        Ok(intervals)
    }

    pub fn n_intervals(&self) -> usize {
        self.samples.len()
    }

    pub fn n_frames(&self, interval: usize) -> usize {
        self.samples[interval].n_frames
    }

    /// Number of spectrogram frames of an interval, at least enough for its motion.
    pub fn n_mels(&self, interval: usize) -> usize {
        let sample = &self.samples[interval];
        // Because of rounding, the motion may need one spectrogram frame more than the sound has.
        let enough = mel::n_samples(mel_frames(self.dataset.info().fps, sample.n_frames) + 1);
        mel::n_frames(enough.max(sample.n_sound_samples()))
    }

    /// Words of all intervals, sorted by start time.
    pub fn words(&self, vocabulary: &Vocabulary) -> Result<Vec<Vec<NumberedWord>>> {
        let of_sample = |sample| Ok(vocabulary.numbered(&self.dataset.words(sample)?.unwrap_or_default()));
        self.samples.iter().map(of_sample).collect()
    }

    /// Rows that contain at least these frames of motion and these spectrogram frames.
    pub fn rows(&self, interval: usize, frames: Range<usize>, mels: Range<usize>) -> Result<Cow<'_, IntervalRows>> {
        Ok(match &self.cached {
            Some(cached) => Cow::Borrowed(&cached[interval]),
            None => Cow::Owned(self.read(interval, frames, mels)?),
        })
    }

    fn read(&self, interval: usize, frames: Range<usize>, mels: Range<usize>) -> Result<IntervalRows> {
        let sample = &self.samples[interval];
        let (first_frame, first_mel) = (frames.start, mels.start);
        let mut motion = self.dataset.motion(sample, frames.clone())?;
        // Bone lengths differ between videos, but the generator learns one body.
        bones::with_lengths(&mut motion, &self.normal.lengths());
        let posture = if self.normal.channels.is_empty() { None } else { self.dataset.posture(sample, frames)? };
        let (features, mask) = self.normal.features_with_channels(&motion, posture.as_ref());
        let start = mels.start * mel::HOP;
        let n_samples = mel::n_samples(mels.len());
        let n_available = sample.n_sound_samples();
        let mut samples =
            self.dataset.sound(sample, start.min(n_available)..(start + n_samples).min(n_available))?.samples;
        samples.resize(n_samples, 0.0);
        let mels = mel::log_mel(&samples).reversed_axes().as_standard_layout().into_owned();
        Ok(IntervalRows { features, mask, mels, first_frame, first_mel })
    }
}

/// Neighbouring frames of a fractional frame position, at most `last`, and the weight 0..1 of the second one.
pub(super) fn between(at: f64, last: usize) -> (usize, usize, f32) {
    let low = (at.max(0.0) as usize).min(last);
    (low, (low + 1).min(last), if low < last { (at - low as f64) as f32 } else { 0.0 })
}

/// Position in a sequence from 0 to `last` for one in its continuation by mirror images.
pub(super) fn mirrored(at: f64, last: f64) -> f64 {
    last - (at.rem_euclid(2.0 * last.max(1.0)) - last).abs()
}

/// Smallest range that contains these indices.
pub(super) fn range_of(indices: &[usize]) -> Range<usize> {
    let [low, high] = [indices.iter().min(), indices.iter().max()];
    low.copied().unwrap_or(0)..high.map_or(0, |high| high + 1)
}
