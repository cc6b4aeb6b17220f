//! Segments of sequences as batches: the poses before, the sound and words, and the poses to predict.

use super::sequence::PoseSequence;
use crate::generate::seq2seq::architecture;
use crate::generate::seq2seq::metadata::SequenceMetadata;
use crate::generate::seq2seq::vocabulary::NumberedWord;
use anyhow::{Result, ensure};
use candle_core::{Device, Tensor};
use ndarray::s;
use orator_base::types::interval::Interval;
use orator_nn::seq2seq::config::{Config, Segment};

/// All segments of sequences.
pub struct SegmentLoader {
    metadata: SequenceMetadata,
    sequences: Vec<PoseSequence>,
    /// Words of each sequence.
    said: Vec<Vec<NumberedWord>>,
    /// Sequence, and first frame of the poses before.
    starts: Vec<(usize, usize)>,
}

/// Segments side by side, f32.
pub struct SegmentBatch {
    pub segment: Segment,
    /// Poses to predict [B, predicted, C]; where they are not known, what fills them.
    pub real: Tensor,
    /// [B, predicted, C]: 1 where a number is to be learnt.
    pub known: Tensor,
    /// Real numbers where they are not known, 0 elsewhere.
    filled: Tensor,
}

impl SegmentBatch {
    /// Poses of a network with the real ones' filling where nothing is known, so that nothing is learnt there.
    pub fn completed(&self, made: &Tensor) -> candle_core::Result<Tensor> {
        (made * &self.known)? + &self.filled
    }
}

impl SegmentLoader {
    /// Segments every `stride` frames of the sequences that are long enough for one; 0: as long as what is predicted.
    pub fn new(sequences: Vec<PoseSequence>, metadata: &SequenceMetadata, stride: usize) -> Self {
        let Config { previous, predicted, .. } = metadata.network;
        let stride = if stride == 0 { predicted } else { stride };
        let of_sequence = |(i, sequence): (usize, &PoseSequence)| {
            let n = Interval { start: 0, end: sequence.poses.nrows() }.n_windows(previous + predicted, stride);
            (0..n).map(move |segment| (i, segment * stride)).collect::<Vec<_>>()
        };
        let starts = sequences.iter().enumerate().flat_map(of_sequence).collect();
        let said = sequences.iter().map(|sequence| metadata.vocabulary.numbered(&sequence.words)).collect();
        Self { metadata: metadata.clone(), sequences, said, starts }
    }

    /// Number of segments.
    pub fn len(&self) -> usize {
        self.starts.len()
    }

    pub fn is_empty(&self) -> bool {
        self.starts.is_empty()
    }

    /// The segments of these numbers (each below `len`) as one batch.
    pub fn batch(&self, which: &[usize]) -> Result<SegmentBatch> {
        ensure!(which.iter().all(|i| *i < self.len()), "segments {which:?} of {}", self.len());
        self.batch_of_starts(&which.iter().map(|i| self.starts[*i]).collect::<Vec<_>>())
    }

    /// Whether a whole segment ends where the poses of this one (below `len`) begin to be predicted.
    pub fn has_segment_before(&self, which: usize) -> bool {
        self.starts.get(which).is_some_and(|(_, start)| *start >= self.metadata.network.predicted)
    }

    /// The segments that end where these, which all have one before them, begin to be predicted.
    pub fn batch_before(&self, which: &[usize]) -> Result<SegmentBatch> {
        ensure!(which.iter().all(|i| self.has_segment_before(*i)), "no segment before one of {which:?}");
        let predicted = self.metadata.network.predicted;
        let start = |(i, start): (usize, usize)| (i, start - predicted);
        self.batch_of_starts(&which.iter().map(|i| start(self.starts[*i])).collect::<Vec<_>>())
    }

    /// Segments by sequence and first frame of the poses before.
    fn batch_of_starts(&self, starts: &[(usize, usize)]) -> Result<SegmentBatch> {
        ensure!(!starts.is_empty(), "a batch of no segments");
        let SequenceMetadata { architecture, network, .. } = &self.metadata;
        let Config { previous, predicted, pose, audio, .. } = *network;
        let (mut heard, mut before, mut real, mut known) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut words = Vec::new();
        for &(i, start) in starts {
            let (sequence, first) = (&self.sequences[i], start + previous);
            heard.extend(sequence.audio.slice(s![first..first + network.audio_frames(), ..]).iter());
            before.extend(sequence.poses.slice(s![start..first, ..]).iter());
            real.extend(sequence.poses.slice(s![first..first + predicted, ..]).iter());
            let is_known = sequence.known.slice(s![first..first + predicted, ..]);
            known.extend(is_known.iter().map(|known| f32::from(u8::from(*known))));
            words.push(self.metadata.words_of_segment(&self.said[i], first));
        }
        let filled = real.iter().zip(&known).map(|(real, known)| real * (1.0 - known)).collect();
        let tensor =
            |values: Vec<f32>, rows, columns| Tensor::from_vec(values, (starts.len(), rows, columns), &Device::Cpu);
        let segment = Segment {
            audio: tensor(heard, network.audio_frames(), audio)?,
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
