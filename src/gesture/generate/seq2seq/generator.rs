//! Poses for a sound of any length, segment after segment, each begun with the last poses of the one before.

use super::architecture;
use super::metadata::{self, SequenceMetadata};
use super::poses::PoseNumbers;
use super::vocabulary::NumberedWord;
use crate::generate::model::checkpoint_file;
use anyhow::{Result, ensure};
use candle_core::{DType, Device, Tensor};
use ndarray::{Array2, ArrayView2, s};
use orator_base::types::pose3d::Motion;
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_formats::bvh::exponential_maps::smooth;
use orator_formats::transcript::Word;
use orator_nn::seq2seq::config::Config;
use orator_nn::seq2seq::predict::{GesturePredictor, StateAtSeams, generate};
use std::path::Path;

/// A trained sequence-to-sequence network.
pub struct SequenceGenerator {
    /// What the checkpoint says of it.
    pub metadata: SequenceMetadata,
    network: Box<dyn GesturePredictor>,
}

/// A sound and what is said in it, as a network hears and reads them.
pub struct HeardSpeech {
    n_frames: usize,
    /// Cepstra [1, n predicted + context - 1, 26].
    audio: Tensor,
    said: Vec<NumberedWord>,
}

/// Poses for a sound.
#[derive(Clone, Debug)]
pub struct GeneratedPoses {
    /// Numbers of the poses [T, C], smoothed.
    pub numbers: Array2<f32>,
    /// Mean step of the poses over the seam of two segments, as a share of the mean step within segments: as the network
    /// made them, and smoothed. 1 of a single segment.
    pub seam_jump: [f64; 2],
}

impl SequenceGenerator {
    /// Opens a checkpoint of `orator train seq2seq`: a file, or the folder of a training (its best checkpoint).
    pub fn open(path: &Path) -> Result<Self> {
        let (metadata, network) = metadata::load(&checkpoint_file(path)?)?;
        Ok(Self { metadata, network })
    }

    /// Rate of the motion it makes.
    pub fn fps(&self) -> FrameRate {
        self.metadata.fps
    }

    /// Whether it moves the skeleton of the BVH files it learnt from, not the 49 joints.
    pub fn is_captured(&self) -> bool {
        matches!(self.metadata.poses, PoseNumbers::Captured(_))
    }

    /// Whether it reads words, not sound alone.
    pub fn reads_words(&self) -> bool {
        architecture::word_encoder(self.metadata.architecture).is_some()
    }

    /// Whole frames that fit into a sound of so many samples. Errors when there is none.
    pub fn n_frames(&self, n_samples: usize) -> Result<usize> {
        let secs = n_samples as f64 / f64::from(self.metadata.rate);
        let n_frames = (secs * self.fps().per_sec() + 1e-6) as usize;
        ensure!(n_frames > 0, "the sound is {secs:.3} s long: too short for one frame of motion");
        Ok(n_frames)
    }

    /// What the network hears of a sound at `metadata.rate` and reads of what is said in it, which may be nothing. The sound
    /// is filled up with silence to whole segments.
    ///
    /// # Errors
    /// Sound of another rate or shorter than a frame.
    pub fn hear(&self, sound: &Sound, words: &[Word]) -> Result<HeardSpeech> {
        let rate = self.metadata.rate;
        ensure!(sound.rate == rate, "the sound has {} Hz, expected {rate}", sound.rate);
        let n_frames = self.n_frames(sound.samples.len())?;
        let Config { predicted, context, .. } = *self.network.config();
        let features =
            architecture::audio_features(sound, self.fps(), n_frames, n_frames.next_multiple_of(predicted), context);
        let shape = (1, features.nrows(), features.ncols());
        let audio = Tensor::from_iter(features.iter().copied(), &Device::Cpu)?.reshape(shape)?;
        Ok(HeardSpeech { n_frames, audio, said: self.metadata.vocabulary.numbered(words) })
    }

    /// Poses for the audio. The first segment goes on from the mean pose.
    ///
    /// # Errors
    /// A network that makes numbers that are not finite.
    pub fn speak(&self, speech: &HeardSpeech, seams: StateAtSeams) -> Result<GeneratedPoses> {
        let HeardSpeech { n_frames, audio, said } = speech;
        let Config { pose, previous, predicted, .. } = *self.network.config();
        let start = Tensor::zeros((1, previous, pose), DType::F32, &Device::Cpu)?;
        let of = &self.metadata;
        let words = |i| architecture::words_tensor(of.architecture, &[of.words_of_segment(said, i * predicted)]);
        let made = generate(&*self.network, audio, &start, seams, words)?.flatten_all()?.to_vec1::<f32>()?;
        ensure!(
            made.iter().all(|number| number.is_finite()),
            "the network makes numbers that are not finite: its checkpoint was damaged, or its training failed"
        );
        let made = Array2::from_shape_vec((made.len() / pose, pose), made)?;
        let mut numbers = made.slice(s![..*n_frames, ..]).to_owned();
        let raw = seam_jump(numbers.view(), predicted);
        smooth(&mut numbers);
        let smoothed = seam_jump(numbers.view(), predicted);
        Ok(GeneratedPoses { numbers, seam_jump: [raw, smoothed] })
    }

    /// Poses for a sound, `hear` and then `speak` with the state renewed at seams.
    pub fn poses(&self, sound: &Sound, words: &[Word]) -> Result<GeneratedPoses> {
        self.speak(&self.hear(sound, words)?, StateAtSeams::Renewed)
    }

    /// Motion of the 49 joints. Errors where it learnt a captured skeleton.
    pub fn motion(&self, poses: &GeneratedPoses) -> Result<Motion> {
        self.metadata.poses.motion(poses.numbers.view(), self.fps())
    }

    /// BVH text in the captured skeleton. Errors where it learnt the 49 joints.
    pub fn bvh(&self, poses: &GeneratedPoses) -> Result<String> {
        self.metadata.poses.bvh(poses.numbers.view())
    }
}

/// Mean step over seams as a share of the mean step elsewhere; 1 where there is none of either.
fn seam_jump(numbers: ArrayView2<f32>, predicted: usize) -> f64 {
    let (mut seams, mut others) = ((0.0, 0usize), (0.0, 0usize));
    for t in 1..numbers.nrows() {
        let (before, now) = (numbers.row(t - 1), numbers.row(t));
        let squares = now.iter().zip(&before).map(|(a, b)| f64::from(a - b).powi(2));
        let sum = if t.is_multiple_of(predicted) { &mut seams } else { &mut others };
        *sum = (sum.0 + squares.sum::<f64>().sqrt(), sum.1 + 1);
    }
    let mean = |(sum, n): (f64, usize)| sum / n.max(1) as f64;
    if seams.1 > 0 && mean(others) > 0.0 { mean(seams) / mean(others) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_at_each_seam_is_measured() {
        let ramp = Array2::from_shape_fn((12, 2), |(t, _)| t as f32 + 2.0 * (t / 4) as f32);
        assert!((seam_jump(ramp.view(), 4) - 3.0).abs() < 1e-6);
        assert_eq!(seam_jump(ramp.slice(s![..3, ..]), 4), 1.0);
    }
}
