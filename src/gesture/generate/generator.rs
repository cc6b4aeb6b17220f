//! Generation of motion from speech with a trained GAN, chunk by chunk, so that memory does not grow with the sound.

use super::mel_stream::{MelStream, mel_frames};
use super::model::{self, GenerationChoice, SpeakerMetadata, checkpoint_file};
use anyhow::{Result, ensure};
use ndarray::{Array2, Array3, s};
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::{Posture, PostureChannel};
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::sound::{SAMPLE_RATE, Sound};
use orator_base::types::time::FrameRate;
use orator_nn::gan::generator::{FRAMES_MULTIPLE, Generator};
use orator_nn::gan::streaming::StreamingGenerator;
use std::path::Path;

/// Frames generated at once, many more than the 256 context frames that are computed in addition and dropped.
pub const CHUNK: usize = 2048;

/// A trained GAN generator of one speaker.
pub struct GestureGenerator {
    /// Metadata stored in the checkpoint.
    pub metadata: SpeakerMetadata,
    pub generator: Generator,
}

impl GestureGenerator {
    /// Opens a checkpoint of `orator train gan`: a file, or the best checkpoint in the folder of a training.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_as(path, &GenerationChoice::default())
    }

    /// Like `open`, for the chosen speaker and variant. Also fails for a speaker that the network does not have, and
    /// for variants of a network that was trained without dropout.
    pub fn open_as(path: &Path, choice: &GenerationChoice) -> Result<Self> {
        let (metadata, generator) = model::load(&checkpoint_file(path)?, choice)?;
        Ok(Self { metadata, generator })
    }

    /// Name of the speaker.
    pub fn name(&self) -> &str {
        &self.metadata.name
    }

    /// Frame rate of the generated motion.
    pub fn fps(&self) -> FrameRate {
        self.metadata.fps
    }

    /// Motion for `sound` (16 kHz) with the speaker's bone lengths, as many complete frames as fit into the sound.
    /// Fails for another sample rate, and for sound shorter than a frame.
    pub fn motion(&self, sound: &Sound) -> Result<Motion> {
        Ok(self.motion_and_posture(sound)?.0)
    }

    /// Like `motion`, with the angles of head and trunk if the network was trained on them.
    pub fn motion_and_posture(&self, sound: &Sound) -> Result<(Motion, Option<Posture>)> {
        ensure!(
            sound.rate == SAMPLE_RATE,
            "the audio has a sample rate of {} Hz, expected {SAMPLE_RATE} Hz",
            sound.rate
        );
        let pieces = sound.samples.chunks(SAMPLE_RATE as usize).map(|piece| Ok(piece.to_vec()));
        self.motion_from_stream(pieces, sound.samples.len(), CHUNK, &mut |_| ())
    }

    /// Motion and posture for a stream of sound pieces (16 kHz, `n_samples` in total), generated in chunks of `chunk`
    /// frames. Apart from the motion, memory does not grow with the sound. `on_chunk` is called with the number of
    /// frames of each chunk.
    ///
    /// # Errors
    /// Errors of `motion`; fewer samples than `n_samples`; a `chunk` that is not a multiple of 32.
    pub fn motion_from_stream(
        &self,
        pieces: impl Iterator<Item = Result<Vec<f32>>>,
        n_samples: usize,
        chunk: usize,
        on_chunk: &mut dyn FnMut(usize),
    ) -> Result<(Motion, Option<Posture>)> {
        let n_frames = self.n_frames(n_samples)?;
        let mut joints = Array3::zeros((n_frames, N_JOINTS, 3));
        let normal = &self.metadata.normalisation;
        let mut posture = (!normal.channels.is_empty()).then(|| Posture::missing(n_frames));
        let mut first = 0;
        for poses in self.features(pieces, n_samples, chunk)? {
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
    /// multiple of 32 frames.
    pub fn features(
        &self,
        pieces: impl Iterator<Item = Result<Vec<f32>>>,
        n_samples: usize,
        chunk: usize,
    ) -> Result<impl Iterator<Item = Result<Array2<f32>>>> {
        let n_frames = self.n_frames(n_samples)?;
        let padded = (n_frames / FRAMES_MULTIPLE + 1) * FRAMES_MULTIPLE;
        let n_mel_frames = mel_frames(self.fps(), padded);
        let mut stream = MelStream::new(pieces, n_samples, n_mel_frames);
        let mels = move |frames| stream.log_mels(frames).map_err(|error| candle_core::Error::Msg(format!("{error:#}")));
        let preset = self.metadata.network.preset;
        let chunks = StreamingGenerator::new(&self.generator, preset, n_mel_frames, padded, chunk, mels)?;
        Ok(chunks.zip((0..n_frames).step_by(chunk)).map(move |(poses, first)| {
            let n = chunk.min(n_frames - first);
            let poses: Vec<f32> = poses?.narrow(2, 0, n)?.flatten_all()?.to_vec1()?;
            ensure!(
                poses.iter().all(|number| number.is_finite()),
                "the network output is not finite from frame {first} on: the checkpoint is damaged, or its training failed"
            );
            Ok(Array2::from_shape_vec((self.metadata.network.n_out, n), poses)?)
        }))
    }

    /// Number of complete frames of motion for `n_samples` samples at 16 kHz. Fails if there is none.
    pub fn n_frames(&self, n_samples: usize) -> Result<usize> {
        let secs = n_samples as f64 / f64::from(SAMPLE_RATE);
        let n_frames = (secs * self.fps().per_sec() + 1e-6) as usize;
        ensure!(n_frames > 0, "the audio is too short for one frame of motion: {secs:.3} s");
        Ok(n_frames)
    }
}
