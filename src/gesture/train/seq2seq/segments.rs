//! Poses, audio features and words of an uninterrupted stretch of motion, and batches of its segments: previous poses,
//! audio features and words as input, poses to predict as target. The previous poses of some segments are replaced by
//! poses that the network predicts, as in generation for all segments but the first (scheduled sampling, Bengio et al.
//! 2015): trained on real previous poses only, a network learns to copy them and depends too little on the audio.

use crate::generate::seq2seq::architecture::{self, NumberedWord};
use crate::generate::seq2seq::metadata::SequenceMetadata;
use anyhow::{Result, ensure};
use candle_core::{Device, Tensor};
use ndarray::{Array2, ArrayView1, ArrayViewMut1, s};
use orator_base::types::interval::Interval;
use orator_formats::transcript::Word;
use orator_nn::Mode;
use orator_nn::seq2seq::config::{Config, Segment};
use orator_nn::seq2seq::predict::GesturePredictor;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Cuts sequences into segments and assembles batches of them.
pub struct SegmentLoader {
    metadata: SequenceMetadata,
    sequences: Vec<PoseSequence>,
    words: Vec<Vec<NumberedWord>>,
    /// Sequence index and first frame of the previous poses of each segment.
    starts: Vec<(usize, usize)>,
}

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
    /// Predicted poses with the values of `real` where the target is unknown, so that loss and gradient are zero there.
    pub fn completed(&self, predicted: &Tensor) -> candle_core::Result<Tensor> {
        (predicted * &self.known)? + &self.filled
    }

    /// Copies the segments to a device.
    pub fn on(&self, device: &Device) -> candle_core::Result<Self> {
        let on = |tensor: &Tensor| tensor.to_device(device);
        let segment = self.segment.on(device)?;
        Ok(Self { segment, real: on(&self.real)?, known: on(&self.known)?, filled: on(&self.filled)? })
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

/// Uninterrupted motion with its audio features and words.
#[derive(Clone, Debug)]
pub struct PoseSequence {
    /// Features of the poses [T, C]; unknown values are interpolated.
    pub poses: Array2<f32>,
    /// Mask [T, C] of the known values, which are trained on.
    pub known: Array2<bool>,
    /// Cepstra with half a context on either side [T + context - 1, 26].
    pub audio: Array2<f32>,
    /// Words with times in seconds from the first pose; empty if there is no transcript.
    pub words: Vec<Word>,
}

pub struct SequenceSplits {
    pub train: Vec<PoseSequence>,
    pub held_out: Vec<PoseSequence>,
    /// Warnings about the data, one sentence each.
    pub notes: Vec<String>,
}

impl PoseSequence {
    /// Sequence whose unknown values are interpolated between the known ones before and after them.
    pub fn new(mut poses: Array2<f32>, known: Array2<bool>, audio: Array2<f32>, words: Vec<Word>) -> Self {
        for (column, known) in poses.columns_mut().into_iter().zip(known.columns()) {
            interpolate(column, known);
        }
        Self { poses, known, audio, words }
    }
}

/// Interpolates linearly between known values and holds the first and the last; all 0 if none is known.
pub fn interpolate(mut values: ArrayViewMut1<f32>, known: ArrayView1<bool>) {
    let known_frames: Vec<usize> = (0..known.len()).filter(|t| known[*t]).collect();
    let (Some(&first), Some(&last)) = (known_frames.first(), known_frames.last()) else { return values.fill(0.0) };
    for t in 0..first {
        values[t] = values[first];
    }
    for t in last + 1..values.len() {
        values[t] = values[last];
    }
    for pair in known_frames.windows(2) {
        for t in pair[0] + 1..pair[1] {
            let share = (t - pair[0]) as f32 / (pair[1] - pair[0]) as f32;
            values[t] = values[pair[0]] * (1.0 - share) + values[pair[1]] * share;
        }
    }
}

/// Replaces the previous poses of a random `share` (0..1) of the segments `which` of a batch by the last poses that the
/// network predicts for the preceding segment from its real previous poses. Segments without a complete preceding
/// segment are left unchanged, and so are all if `previous > predicted`.
pub fn roll_out_previous(
    batch: &mut SegmentBatch,
    which: &[usize],
    loader: &SegmentLoader,
    network: &dyn GesturePredictor,
    share: f64,
    rng: &mut ChaCha8Rng,
) -> Result<()> {
    let Config { previous, predicted, .. } = *network.config();
    let chosen: Vec<usize> = (0..which.len()).filter(|_| rng.random_bool(share)).collect();
    let chosen: Vec<usize> = chosen.into_iter().filter(|row| loader.has_segment_before(which[*row])).collect();
    if chosen.is_empty() || previous > predicted {
        return Ok(());
    }
    let preceding = loader.batch_before(&chosen.iter().map(|row| which[*row]).collect::<Vec<_>>())?;
    let preceding = preceding.segment.on(batch.real.device())?;
    let predicted_poses = network.forward(&preceding, &mut Mode::Eval)?.detach();
    let predicted_poses = predicted_poses.narrow(1, predicted - previous, previous)?;
    let mut rows =
        (0..which.len()).map(|row| batch.segment.previous.get(row)).collect::<candle_core::Result<Vec<_>>>()?;
    for (n, row) in chosen.into_iter().enumerate() {
        rows[row] = predicted_poses.get(n)?;
    }
    batch.segment.previous = Tensor::stack(&rows, 0)?;
    Ok(())
}
