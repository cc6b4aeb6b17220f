//! Batches of training segments: previous poses, audio features and words as input, and the poses to predict as target.

use super::sequence::PoseSequence;
use crate::generate::seq2seq::architecture;
use crate::generate::seq2seq::metadata::SequenceMetadata;
use crate::generate::seq2seq::vocabulary::NumberedWord;
use anyhow::{Result, ensure};
use candle_core::{Device, Tensor};
use ndarray::s;
use orator_base::types::interval::Interval;
use orator_nn::seq2seq::config::{Config, Segment};

/// Cuts sequences into segments and assembles batches of them.
pub struct SegmentLoader {
    metadata: SequenceMetadata,
    sequences: Vec<PoseSequence>,
    /// Words of each sequence as vocabulary indices.
    words: Vec<Vec<NumberedWord>>,
    /// Sequence index and first frame of the previous poses of each segment.
    starts: Vec<(usize, usize)>,
}

/// Batch of segments, f32.
pub struct SegmentBatch {
    pub segment: Segment,
    /// Target poses [B, predicted, C]; unknown values are interpolated.
    pub real: Tensor,
    /// Mask [B, predicted, C]: 1 where the target is known and contributes to the loss.
    pub known: Tensor,
    /// Interpolated values of `real` where they are not known, 0 elsewhere.
    filled: Tensor,
}

impl SegmentBatch {
    /// Predicted poses with the values of `real` wherever the target is not known, so that the loss and its gradient
    /// are zero there.
    pub fn completed(&self, predicted: &Tensor) -> candle_core::Result<Tensor> {
        (predicted * &self.known)? + &self.filled
    }
}

impl SegmentLoader {
    /// Segments every `stride` frames of all sequences that are long enough; a stride of 0 means `predicted` frames.
    pub fn new(sequences: Vec<PoseSequence>, metadata: &SequenceMetadata, stride: usize) -> Self {
        let Config { previous, predicted, .. } = metadata.network;
        let stride = if stride == 0 { predicted } else { stride };
        let of_sequence = |(i, sequence): (usize, &PoseSequence)| {
            let n = Interval { start: 0, end: sequence.poses.nrows() }.n_windows(previous + predicted, stride);
            (0..n).map(move |segment| (i, segment * stride)).collect::<Vec<_>>()
        };
        let starts = sequences.iter().enumerate().flat_map(of_sequence).collect();
        let words = sequences.iter().map(|sequence| metadata.vocabulary.numbered(&sequence.words)).collect();
        Self { metadata: metadata.clone(), sequences, words, starts }
    }

    /// Number of segments.
    pub fn len(&self) -> usize {
        self.starts.len()
    }

    pub fn is_empty(&self) -> bool {
        self.starts.is_empty()
    }

    /// Batch of the segments with these indices.
    ///
    /// # Errors
    /// An index of `len` or more; no index.
    pub fn batch(&self, which: &[usize]) -> Result<SegmentBatch> {
        ensure!(
            which.iter().all(|i| *i < self.len()),
            "invalid segments {which:?}: expected indices below {}",
            self.len()
        );
        self.batch_of_starts(&which.iter().map(|i| self.starts[*i]).collect::<Vec<_>>())
    }

    /// Whether a complete segment ends where the predicted poses of this segment (index below `len`) start.
    pub fn has_segment_before(&self, which: usize) -> bool {
        self.starts.get(which).is_some_and(|(_, start)| *start >= self.metadata.network.predicted)
    }

    /// Batch of the segments that end where the predicted poses of these segments start.
    ///
    /// # Errors
    /// A segment without a complete preceding one (`has_segment_before`).
    pub fn batch_before(&self, which: &[usize]) -> Result<SegmentBatch> {
        ensure!(which.iter().all(|i| self.has_segment_before(*i)), "no complete segment before one of {which:?}");
        let predicted = self.metadata.network.predicted;
        let start = |(i, start): (usize, usize)| (i, start - predicted);
        self.batch_of_starts(&which.iter().map(|i| start(self.starts[*i])).collect::<Vec<_>>())
    }

    /// Batch of the segments given by sequence index and first frame of their previous poses.
    fn batch_of_starts(&self, starts: &[(usize, usize)]) -> Result<SegmentBatch> {
        ensure!(!starts.is_empty(), "empty batch of segments");
        let SequenceMetadata { architecture, network, .. } = &self.metadata;
        let Config { previous, predicted, pose, audio, .. } = *network;
        let (mut audio_values, mut before, mut real, mut known) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut words = Vec::new();
        for &(i, start) in starts {
            let (sequence, first) = (&self.sequences[i], start + previous);
            audio_values.extend(sequence.audio.slice(s![first..first + network.audio_frames(), ..]).iter());
            before.extend(sequence.poses.slice(s![start..first, ..]).iter());
            real.extend(sequence.poses.slice(s![first..first + predicted, ..]).iter());
            let is_known = sequence.known.slice(s![first..first + predicted, ..]);
            known.extend(is_known.iter().map(|known| f32::from(u8::from(*known))));
            words.push(self.metadata.words_of_segment(&self.words[i], first));
        }
        let filled = real.iter().zip(&known).map(|(real, known)| real * (1.0 - known)).collect();
        let tensor =
            |values: Vec<f32>, rows, columns| Tensor::from_vec(values, (starts.len(), rows, columns), &Device::Cpu);
        let segment = Segment {
            audio: tensor(audio_values, network.audio_frames(), audio)?,
            previous: tensor(before, previous, pose)?,
            words: architecture::words_tensor(*architecture, &words)?,
        };
        Ok(SegmentBatch {
            segment,
            real: tensor(real, predicted, pose)?,
            known: tensor(known, predicted, pose)?,
            filled: tensor(filled, predicted, pose)?,
        })
    }
}
