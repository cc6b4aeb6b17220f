//! Generation of motion from speech with a trained GAN, chunk by chunk, so that memory does not grow with the sound:
//! its spectrogram is computed as it is requested, in order, and samples that are no longer needed are dropped. Beyond
//! its end the sound is extended by its mirror image, for which the tail is kept.

use super::model::{self, GenerationChoice, SpeakerMetadata, checkpoint_file};
use super::word_input::{KnownWords, TrainedWords, WordFrameList, check_vectors};
use anyhow::{Context, Result, ensure};
use candle_core::{Device, Tensor};
use ndarray::{Array2, Array3, s};
use orator_base::audio::mel;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::{Posture, PostureChannel};
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::sound::{SAMPLE_RATE, Sound, sample_at};
use orator_base::types::time::FrameRate;
use orator_formats::transcript::Word;
use orator_formats::word_vectors::WordVectors;
use orator_nn::gan::generator::{FRAMES_MULTIPLE, Generator};
use orator_nn::gan::streaming::StreamingGenerator;
use orator_nn::gan::words::WordFrames;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// Frames generated at once, many more than the 256 context frames that are computed in addition and dropped.
pub const CHUNK: usize = 2048;

/// A trained GAN generator of one speaker.
pub struct GestureGenerator {
    pub metadata: SpeakerMetadata,
    pub generator: Generator,
    vectors: Option<Arc<WordVectors>>,
}

impl GestureGenerator {
    /// Opens a checkpoint of `orator train gan`: a file, or the best checkpoint in the folder of a training.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_as(path, &GenerationChoice::default(), &Device::Cpu)
    }

    /// Like `open`, for the chosen speaker and variant, on `device`. Also fails for a speaker that the network does not
    /// have, and for variants of a network that was trained without dropout.
    pub fn open_as(path: &Path, choice: &GenerationChoice, device: &Device) -> Result<Self> {
        let (metadata, generator) = model::load(&checkpoint_file(path)?, choice, device)?;
        Ok(Self::new(metadata, generator))
    }

    /// Generator of a network with this metadata.
    pub fn new(metadata: SpeakerMetadata, generator: Generator) -> Self {
        Self { metadata, generator, vectors: None }
    }

    /// Words that are not in the vocabulary take their vectors from this table. Without a table, or without a vector in
    /// it, all have the vector of the unknown word.
    ///
    /// # Errors
    /// A network that does not read words or was trained without a table, or whose word vectors have another dimension.
    pub fn set_word_vectors(&mut self, vectors: Arc<WordVectors>) -> Result<()> {
        let SpeakerMetadata { name, words, network, .. } = &self.metadata;
        let words = words.as_ref().with_context(|| format!("the model of {name} does not read words: omit --words"))?;
        check_vectors(name, words.has_word_vectors, network.word, &vectors)?;
        self.vectors = Some(vectors);
        Ok(())
    }

    /// Vocabulary and table of word vectors; `None` if the network does not read words.
    pub fn known_words(&self) -> Option<KnownWords<'_>> {
        let TrainedWords { vocabulary, .. } = self.metadata.words.as_ref()?;
        Some(KnownWords { vocabulary, vectors: self.vectors.as_deref() })
    }

    pub fn name(&self) -> &str {
        &self.metadata.name
    }

    pub fn fps(&self) -> FrameRate {
        self.metadata.fps
    }

    /// Motion for `sound` (16 kHz) and its words with the speaker's bone lengths, as many complete frames as fit into the
    /// sound. Networks without word input ignore the words. Fails for another sample rate, and for sound shorter than a
    /// frame.
    pub fn motion(&self, sound: &Sound, words: &[Word]) -> Result<Motion> {
        Ok(self.motion_and_posture(sound, words)?.0)
    }

    /// Like `motion`, with the angles of head and trunk if the network was trained on them.
    pub fn motion_and_posture(&self, sound: &Sound, words: &[Word]) -> Result<(Motion, Option<Posture>)> {
        ensure!(
            sound.rate == SAMPLE_RATE,
            "the audio has a sample rate of {} Hz, expected {SAMPLE_RATE} Hz",
            sound.rate
        );
        let pieces = sound.samples.chunks(SAMPLE_RATE as usize).map(|piece| Ok(piece.to_vec()));
        self.motion_from_stream(pieces, sound.samples.len(), words, CHUNK, &mut |_| ())
    }

    /// Motion and posture for sound pieces (16 kHz, `n_samples` in total), generated in chunks of `chunk` frames. Apart
    /// from the motion, memory does not grow with the sound. `on_chunk` gets the number of frames of each chunk.
    ///
    /// # Errors
    /// Errors of `motion`; fewer samples than `n_samples`; a `chunk` that is not a multiple of 32.
    pub fn motion_from_stream(
        &self,
        pieces: impl Iterator<Item = Result<Vec<f32>>>,
        n_samples: usize,
        words: &[Word],
        chunk: usize,
        on_chunk: &mut dyn FnMut(usize),
    ) -> Result<(Motion, Option<Posture>)> {
        let n_frames = self.n_frames(n_samples)?;
        let mut joints = Array3::zeros((n_frames, N_JOINTS, 3));
        let normal = &self.metadata.normalisation;
        let mut posture = (!normal.channels.is_empty()).then(|| Posture::missing(n_frames));
        let mut first = 0;
        for poses in self.features(pieces, n_samples, words, chunk)? {
            let poses = poses?;
            let part = self.metadata.motion(poses.view());
            joints.slice_mut(s![first..first + poses.ncols(), .., ..]).assign(&part.joints);
            if let (Some(posture), Some(part)) = (&mut posture, normal.posture(poses.view())) {
                for channel in PostureChannel::ALL {
                    let mut frames = posture.channel_mut(channel).slice_mut(s![first..first + poses.ncols(), ..]);
                    frames.assign(part.channel(channel));
                }
            }
            first += poses.ncols();
            on_chunk(poses.ncols());
        }
        Ok((Motion::from_joints(self.fps(), joints), posture))
    }

    /// Raw network output [features, T] in chunks of at most `chunk` frames, which [`SpeakerMetadata::motion`] converts
    /// to motion, for sound pieces as in [`Self::motion_from_stream`]. The sound is extended by its mirror image to a
    /// multiple of 32 frames; for a network with a limited look-ahead by silence.
    pub fn features<'a>(
        &'a self,
        pieces: impl Iterator<Item = Result<Vec<f32>>> + 'a,
        n_samples: usize,
        words: &[Word],
        chunk: usize,
    ) -> Result<Box<dyn Iterator<Item = Result<Array2<f32>>> + 'a>> {
        let n_frames = self.n_frames(n_samples)?;
        let n_of = move |first: usize| chunk.min(n_frames - first);
        if self.metadata.network.look_ahead.is_some() {
            let chunk = chunk.min(n_frames);
            let chunks = (0..n_frames).step_by(chunk).zip(self.live_features(pieces, chunk)?);
            return Ok(Box::new(chunks.map(move |(first, poses)| Ok(poses?.slice_move(s![.., ..n_of(first)])))));
        }
        let padded = (n_frames / FRAMES_MULTIPLE + 1) * FRAMES_MULTIPLE;
        let n_mel_frames = mel_frames(self.fps(), padded);
        let mut stream = MelStream::new(pieces, n_samples, n_mel_frames);
        let mels = move |frames| stream.log_mels(frames).map_err(|error| candle_core::Error::Msg(format!("{error:#}")));
        let preset = self.metadata.network.preset;
        let chunks = StreamingGenerator::new(&self.generator, preset, n_mel_frames, padded, chunk, mels)?
            .with_words(self.word_frames(words, padded)?);
        let chunks = chunks.zip((0..n_frames).step_by(chunk));
        Ok(Box::new(chunks.map(move |(poses, first)| network_output(&poses?.narrow(2, 0, n_of(first))?, first))))
    }

    /// The words at `n_frames` pose frames; `None` if the network does not read words.
    fn word_frames(&self, words: &[Word], n_frames: usize) -> Result<Option<WordFrames>> {
        let Some(known_words) = self.known_words() else { return Ok(None) };
        let (spoken, added) = known_words.numbered(words)?;
        let mut frames = WordFrameList::default();
        frames.push(&spoken, self.fps(), (0..n_frames).map(|t| self.fps().secs(t)));
        frames.frames(added).map(Some)
    }

    /// Number of complete frames of motion for `n_samples` samples at 16 kHz. Fails if there is none.
    pub fn n_frames(&self, n_samples: usize) -> Result<usize> {
        let secs = n_samples as f64 / f64::from(SAMPLE_RATE);
        let n_frames = (secs * self.fps().per_sec() + 1e-6) as usize;
        ensure!(n_frames > 0, "the audio is too short for one frame of motion: {secs:.3} s");
        Ok(n_frames)
    }
}

/// Output [1, features, T] of a network as an array [features, T]; `first` is the index of its first frame.
pub(super) fn network_output(poses: &Tensor, first: usize) -> Result<Array2<f32>> {
    let (_, n_features, n_frames) = poses.dims3()?;
    let values: Vec<f32> = poses.flatten_all()?.to_vec1()?;
    ensure!(
        values.iter().all(|value| value.is_finite()),
        "the network output is not finite from frame {first} on: the checkpoint is damaged, or its training failed"
    );
    Ok(Array2::from_shape_vec((n_features, n_frames), values)?)
}

/// Spectrogram stream of a sound of known length that is read in pieces of any length.
pub struct MelStream<I> {
    pieces: I,
    n_samples: usize,
    samples: Vec<f32>,
    /// Index in the sound of the first buffered sample.
    first: usize,
    /// Index from which samples are never dropped, as the mirror image needs them.
    tail: usize,
}

impl<I: Iterator<Item = Result<Vec<f32>>>> MelStream<I> {
    /// Stream over `pieces` with `n_samples` samples in total, which computes the first `n_mel_frames` spectrogram frames.
    pub fn new(pieces: I, n_samples: usize, n_mel_frames: usize) -> Self {
        let end = mel::n_samples(n_mel_frames);
        let period = period(n_samples);
        let tail = if end > period { 0 } else { n_samples.min((period + 1).saturating_sub(end)) };
        Self { pieces, n_samples, samples: Vec::new(), first: 0, tail }
    }

    /// Log-mels [1, 64, T] of these spectrogram frames. Successive ranges may overlap, but starts must not decrease.
    pub fn log_mels(&mut self, frames: Range<usize>) -> Result<Tensor> {
        let first = frames.start * mel::HOP;
        log_mel_tensor(&self.mirrored(first..first + mel::n_samples(frames.len()))?)
    }

    /// These samples of the sound extended periodically by its mirror image.
    fn mirrored(&mut self, range: Range<usize>) -> Result<Vec<f32>> {
        let needed = range.start.min(self.tail);
        if needed > self.first {
            self.samples.drain(..(needed - self.first).min(self.samples.len()));
            self.first = needed;
        }
        while self.first + self.samples.len() < range.end.min(self.n_samples) {
            let n_read = self.first + self.samples.len();
            let Some(piece) = self.pieces.next() else {
                anyhow::bail!(
                    "the audio ended after {n_read} of {} samples: the file changed while it was read",
                    self.n_samples
                )
            };
            self.samples.extend(piece?);
        }
        let period = period(self.n_samples);
        let at = |i: usize| if i < self.n_samples { i } else { period - i };
        let samples: Option<Vec<f32>> =
            range.map(|i| self.samples.get(at(i % period).checked_sub(self.first)?).copied()).collect();
        samples.ok_or_else(|| anyhow::anyhow!("spectrogram frames were requested out of order"))
    }
}

/// Log-mels [1, 64, T] of these samples.
pub(super) fn log_mel_tensor(samples: &[f32]) -> Result<Tensor> {
    let mels = mel::log_mel(samples);
    let shape = (1, mel::N_MELS, mels.nrows());
    Ok(Tensor::from_iter(mels.t().iter().copied(), &Device::Cpu)?.reshape(shape)?)
}

/// Period in samples of a sound that is extended by its mirror image.
fn period(n_samples: usize) -> usize {
    (2 * n_samples).saturating_sub(2).max(1)
}

/// Number of spectrogram frames (10 ms hops) that span `n_frames` frames of motion, rounded to the nearest integer.
pub fn mel_frames(fps: FrameRate, n_frames: usize) -> usize {
    let rate = orator_base::types::sound::SAMPLE_RATE;
    (sample_at(fps, rate, n_frames) + mel::HOP / 2) / mel::HOP
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream(samples: &[f32], piece: usize, n_mel_frames: usize) -> MelStream<impl Iterator<Item = Result<Vec<f32>>>> {
        let pieces = samples.chunks(piece).map(|piece| Ok(piece.to_vec())).collect::<Vec<_>>();
        MelStream::new(pieces.into_iter(), samples.len(), n_mel_frames)
    }

    #[test]
    fn mel_frames_cover_the_motion() {
        let fps = FrameRate::new(15, 1);
        assert_eq!([64, 1_500].map(|n| mel_frames(fps, n)), [427, 10_000]);
        for (start, n) in [(0, 64), (5, 64), (7, 96), (1_001, 64)] {
            assert!(mel_frames(fps, start) + mel_frames(fps, n) <= mel_frames(fps, start + n) + 1);
        }
    }

    #[test]
    fn sound_is_mirrored_as_long_as_needed() {
        let all = |samples: &[f32], range| stream(samples, 2, 10).mirrored(range).unwrap();
        assert_eq!(all(&[1.0, 2.0, 3.0], 0..8), [1.0, 2.0, 3.0, 2.0, 1.0, 2.0, 3.0, 2.0]);
        assert_eq!(all(&[1.0], 0..3), [1.0, 1.0, 1.0]);
        assert_eq!(all(&[1.0, 2.0, 3.0], 3..5), [2.0, 1.0]);
    }

    #[test]
    fn streaming_equals_the_complete_spectrogram_with_a_small_buffer() {
        let samples: Vec<f32> = (0..200_000).map(|i| ((i * 7919) % 1009) as f32 / 1009.0 - 0.5).collect();
        let n_mel_frames = mel::n_frames(210_000);
        let whole = stream(&samples, 200_000, n_mel_frames).log_mels(0..n_mel_frames).unwrap();
        let mut stream = stream(&samples, 999, n_mel_frames);
        let mut most = 0;
        for first in (0..n_mel_frames).step_by(100) {
            let frames = first.saturating_sub(20)..(first + 100).min(n_mel_frames);
            let part = stream.log_mels(frames.clone()).unwrap();
            let expected = whole.narrow(2, frames.start, frames.len()).unwrap();
            let numbers = |t: &Tensor| t.flatten_all().unwrap().to_vec1::<f32>().unwrap();
            assert_eq!(numbers(&part), numbers(&expected));
            most = most.max(stream.samples.len());
        }
        assert!(most < 32_000, "{most} samples in memory");
    }

    #[test]
    fn a_sound_that_became_shorter_is_an_error() {
        let mut stream = stream(&[0.1; 5000], 999, mel::n_frames(6000));
        stream.n_samples = 6000;
        let text = stream.log_mels(0..mel::n_frames(6000)).unwrap_err().to_string();
        assert!(text.contains("5000 of 6000"), "{text}");
    }
}
