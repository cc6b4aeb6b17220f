//! Held-out intervals for evaluation: ground truth, posture, sound and words.

use crate::generate::normalisation::Normalisation;
use anyhow::{Result, bail};
use ndarray::{Array3, s};
use orator_base::motion::bones;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::{Posture, PostureChannel};
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::sound::{Sound, samples_of};
use orator_dataset::index::SampleRef;
use orator_dataset::{Dataset, Sample, Split};
use orator_formats::transcript::Word;
use rayon::prelude::*;
use std::ops::Range;

pub struct HeldOutInterval {
    pub key: String,
    /// Motion with the speaker's bone lengths, as in training, instead of those of the video.
    pub ground_truth: Motion,
    /// Angles of head and trunk.
    pub posture: Option<Posture>,
    pub sound: Sound,
    /// Words with times in seconds from the start of the interval.
    pub words: Vec<Word>,
}

/// Samples of `split` in the order of the dataset. Fails if there are none, naming the splits that have some.
pub fn samples(dataset: &Dataset, split: Split) -> Result<Vec<SampleRef>> {
    let samples = dataset.samples(split);
    if samples.is_empty() {
        let others = Split::ALL.into_iter().filter(|other| !dataset.samples(*other).is_empty());
        let others: Vec<&str> = others.map(Split::name).collect();
        bail!(
            "{} has no intervals in the {} split; splits with intervals: {}",
            dataset.dir().display(),
            split.name(),
            others.join(", ")
        );
    }
    Ok(samples)
}

/// Joints [T, 49, 3] of frames with the speaker's bone lengths, then head and trunk angles if `has_channels`.
///
/// # Errors
/// A sample that cannot be read; its hash is not checked.
pub fn joints(
    dataset: &Dataset,
    sample: &SampleRef,
    normal: &Normalisation,
    frames: Range<usize>,
    has_channels: bool,
) -> Result<Array3<f32>> {
    let mut motion = dataset.motion(sample, frames.clone())?;
    bones::with_lengths(&mut motion, &normal.lengths());
    if has_channels {
        Ok(with_posture(&motion.joints, dataset.posture(sample, frames)?.as_ref()))
    } else {
        Ok(motion.joints)
    }
}

/// Reads a sample with the speaker's bone lengths.
pub fn interval(dataset: &Dataset, sample: &SampleRef, normal: &Normalisation) -> Result<HeldOutInterval> {
    let mut sample = dataset.read(sample)?;
    bones::with_lengths(&mut sample.motion, &normal.lengths());
    let words = sample.words.take().unwrap_or_default();
    let Sample { key, motion: ground_truth, posture, sound, .. } = sample;
    Ok(HeldOutInterval { key, ground_truth, posture, sound, words })
}

pub fn read(dataset: &Dataset, samples: &[SampleRef], normal: &Normalisation) -> Result<Vec<HeldOutInterval>> {
    samples.par_iter().map(|sample| interval(dataset, sample, normal)).collect()
}

/// Joints [T, 49, 3] followed by the angles of head and trunk as rows 49 and 50, NaN without posture.
pub fn with_posture(joints: &Array3<f32>, posture: Option<&Posture>) -> Array3<f32> {
    let n_rows = N_JOINTS + PostureChannel::ALL.len();
    Array3::from_shape_fn((joints.shape()[0], n_rows, 3), |(t, row, k)| match row.checked_sub(N_JOINTS) {
        None => joints[[t, row, k]],
        Some(channel) => posture.map_or(f32::NAN, |posture| posture.channel(PostureChannel::ALL[channel])[[t, k]]),
    })
}

impl HeldOutInterval {
    /// Part of the interval: these frames with their sound and the words that lie completely within them.
    pub fn cut(&self, frames: Range<usize>) -> Self {
        let ground_truth = &self.ground_truth;
        let (start, end) = (ground_truth.fps.secs(frames.start), ground_truth.fps.secs(frames.end));
        let inside = self.words.iter().filter(|word| word.start_secs >= start && word.end_secs <= end);
        let moved =
            |word: &Word| Word { start_secs: word.start_secs - start, end_secs: word.end_secs - start, ..word.clone() };
        let sound = samples_of(ground_truth.fps, self.sound.rate, frames.clone());
        let sound = self.sound.samples.get(sound.start..sound.end.min(self.sound.samples.len())).unwrap_or_default();
        Self {
            key: self.key.clone(),
            ground_truth: Motion {
                fps: ground_truth.fps,
                joints: ground_truth.joints.slice(s![frames.clone(), .., ..]).to_owned(),
                mask: ground_truth.mask.slice(s![frames.clone(), ..]).to_owned(),
            },
            posture: self.posture.as_ref().map(|posture| posture.slice(frames)),
            sound: Sound { rate: self.sound.rate, samples: sound.to_vec() },
            words: inside.map(moved).collect(),
        }
    }
}
