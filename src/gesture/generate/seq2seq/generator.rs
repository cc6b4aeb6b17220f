//! Generates poses for a sound of any length by segment; each segment starts from the last poses of the previous one.

use super::architecture::{self, Architecture, NumberedWord};
use super::metadata::{self, SequenceMetadata};
use super::poses::PoseFormat;
use crate::generate::model::checkpoint_file;
use crate::generate::word_input::{KnownWords, check_vectors};
use anyhow::{Result, ensure};
use candle_core::{DType, Device, Tensor};
use ndarray::{Array2, ArrayView2, s};
use orator_base::types::pose3d::Motion;
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_formats::bvh::exponential_maps::smooth;
use orator_formats::transcript::Word;
use orator_formats::word_vectors::WordVectors;
use orator_nn::params::Params;
use orator_nn::seq2seq::config::Config;
use orator_nn::seq2seq::predict::{GesturePredictor, StateAtSeams, generate};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

pub struct SequenceGenerator {
    pub metadata: SequenceMetadata,
    network: Box<dyn GesturePredictor>,
    params: Params,
    vectors: Option<Arc<WordVectors>>,
}

/// Input features of a network for a sound and its words.
pub struct SpeechInput {
    n_frames: usize,
    /// Cepstra [1, n predicted + context - 1, 26] for n segments.
    audio: Tensor,
    words: Vec<NumberedWord>,
    /// Network that also has the vectors of the words outside the vocabulary, if any has one.
    network: Option<Box<dyn GesturePredictor>>,
}

#[derive(Clone, Debug)]
pub struct GeneratedPoses {
    /// Smoothed pose features [T, C].
    pub features: Array2<f32>,
    /// Mean pose change across seams relative to that within, before and after smoothing; 1 for a single segment.
    pub seam_jump: [f64; 2],
}

impl SequenceGenerator {
    /// Opens a checkpoint of `orator train seq2seq`: a file, or the best checkpoint in the folder of a training.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_on(path, &Device::Cpu)
    }

    /// Like `open`, on `device`.
    pub fn open_on(path: &Path, device: &Device) -> Result<Self> {
        let (metadata, params, network) = metadata::load(&checkpoint_file(path)?, device)?;
        Ok(Self { metadata, network, params, vectors: None })
    }

    /// Words that are not in the vocabulary take their vectors from this table. Without a table, or without a vector in
    /// it, all have the vector of the unknown word.
    ///
    /// # Errors
    /// A network that does not read words or was trained without a table, or whose word vectors have another dimension.
    pub fn set_word_vectors(&mut self, vectors: Arc<WordVectors>) -> Result<()> {
        let SequenceMetadata { name, network, has_word_vectors, .. } = &self.metadata;
        ensure!(self.reads_words(), "the model of {name} does not read words: omit --words");
        check_vectors(name, *has_word_vectors, network.word, &vectors)?;
        self.vectors = Some(vectors);
        Ok(())
    }

    /// Tensors of the network.
    pub fn tensors(&self) -> BTreeMap<String, Tensor> {
        self.params.all().map(|(name, var)| (name.to_owned(), var.as_detached_tensor())).collect()
    }

    /// Whether the network has a decoder, whose state can be carried over segment seams.
    pub fn has_state(&self) -> bool {
        self.metadata.architecture != Architecture::Autoencoder
    }

    /// Initial decoder state of the segments, for all callers: carried across segments if requested, or if trained to.
    pub fn seams(&self, carry_state: bool) -> StateAtSeams {
        if self.has_state() && (carry_state || self.metadata.carries_state) {
            StateAtSeams::Carried
        } else {
            StateAtSeams::Renewed
        }
    }

    pub fn fps(&self) -> FrameRate {
        self.metadata.fps
    }

    /// Whether the model animates the skeleton of its BVH training files instead of the 49 joints.
    pub fn is_captured(&self) -> bool {
        matches!(self.metadata.poses, PoseFormat::Captured(_))
    }

    /// Whether the model reads words in addition to audio.
    pub fn reads_words(&self) -> bool {
        architecture::word_encoder(self.metadata.architecture).is_some()
    }

    /// Number of complete frames of motion for a sound of `n_samples` samples. Fails if there is none.
    pub fn n_frames(&self, n_samples: usize) -> Result<usize> {
        let secs = n_samples as f64 / f64::from(self.metadata.rate);
        let n_frames = (secs * self.fps().per_sec() + 1e-6) as usize;
        ensure!(n_frames > 0, "the audio is too short for one frame of motion: {secs:.3} s");
        Ok(n_frames)
    }

    /// Vocabulary and table of word vectors.
    pub fn known_words(&self) -> KnownWords<'_> {
        KnownWords { vocabulary: &self.metadata.vocabulary, vectors: self.vectors.as_deref() }
    }

    /// Input features for a sound at `metadata.rate` and its words, of which there may be none. The sound is padded
    /// with silence to complete segments.
    ///
    /// # Errors
    /// Sound of another rate, or shorter than a frame; a table of word vectors that cannot be read.
    pub fn prepare(&self, sound: &Sound, words: &[Word]) -> Result<SpeechInput> {
        let rate = self.metadata.rate;
        ensure!(sound.rate == rate, "the audio has a sample rate of {} Hz, expected {rate} Hz", sound.rate);
        let n_frames = self.n_frames(sound.samples.len())?;
        let Config { predicted, context, .. } = *self.network.config();
        let cepstra =
            architecture::audio_features(sound, self.fps(), n_frames, n_frames.next_multiple_of(predicted), context);
        let shape = (1, cepstra.nrows(), cepstra.ncols());
        let audio = Tensor::from_iter(cepstra.iter().copied(), self.params.device())?.reshape(shape)?;
        let (words, added) = self.known_words().numbered(words)?;
        let network = added.map(|added| self.metadata.with_word_vectors(&self.params, &added)).transpose()?;
        Ok(SpeechInput { n_frames, audio, words, network })
    }

    /// Generates poses for the input. The first segment starts from the mean pose.
    ///
    /// # Errors
    /// Network output that is not finite.
    pub fn generate(&self, speech: &SpeechInput, seams: StateAtSeams) -> Result<GeneratedPoses> {
        let SpeechInput { n_frames, audio, words, network } = speech;
        let Config { pose, previous, predicted, .. } = *self.network.config();
        let start = Tensor::zeros((1, previous, pose), DType::F32, audio.device())?;
        let of = &self.metadata;
        let words = |i| {
            let words = architecture::words_tensor(of.architecture, &[of.words_of_segment(words, i * predicted)])?;
            words.map(|words| words.to_device(audio.device())).transpose()
        };
        let network = network.as_ref().unwrap_or(&self.network);
        let generated = generate(&**network, audio, &start, seams, words)?.flatten_all()?.to_vec1::<f32>()?;
        ensure!(
            generated.iter().all(|value| value.is_finite()),
            "the network output is not finite: the checkpoint is damaged, or its training failed"
        );
        let generated = Array2::from_shape_vec((generated.len() / pose, pose), generated)?;
        let mut features = generated.slice(s![..*n_frames, ..]).to_owned();
        let raw = seam_jump(features.view(), predicted);
        smooth(&mut features);
        let smoothed = seam_jump(features.view(), predicted);
        Ok(GeneratedPoses { features, seam_jump: [raw, smoothed] })
    }

    /// Generates poses for a sound: `prepare`, then `generate` without a request to carry the decoder state.
    pub fn poses(&self, sound: &Sound, words: &[Word]) -> Result<GeneratedPoses> {
        self.generate(&self.prepare(sound, words)?, self.seams(false))
    }

    /// Motion of the 49 joints. Fails for a model of a captured skeleton.
    pub fn motion(&self, poses: &GeneratedPoses) -> Result<Motion> {
        self.metadata.poses.motion(poses.features.view(), self.fps())
    }

    /// BVH text in the captured skeleton. Fails for a model of the 49 joints.
    pub fn bvh(&self, poses: &GeneratedPoses) -> Result<String> {
        self.metadata.poses.bvh(poses.features.view())
    }
}

/// Mean pose change across seams divided by that elsewhere; 1 if there are no seams, or no motion elsewhere.
fn seam_jump(features: ArrayView2<f32>, predicted: usize) -> f64 {
    let (mut seams, mut others) = ((0.0, 0usize), (0.0, 0usize));
    for t in 1..features.nrows() {
        let (before, now) = (features.row(t - 1), features.row(t));
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
