//! Speech to motion with a trained speaker, chunk by chunk: memory does not grow with the sound.

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

/// Frames generated at once; the 256 context frames that are computed beside them and dropped are a small part.
pub const CHUNK: usize = 2048;

/// A trained speaker.
pub struct GestureGenerator {
    /// What the checkpoint says of it.
    pub metadata: SpeakerMetadata,
    pub generator: Generator,
}

impl GestureGenerator {
    /// Opens a checkpoint of `orator train gan`: a file, or the folder of a training (its best checkpoint).
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_as(path, &GenerationChoice::default())
    }

    /// As `open`, as this speaker and take. Errors as well on a speaker that the network does not know, and on takes of one that was
    /// trained without dropout.
    pub fn open_as(path: &Path, choice: &GenerationChoice) -> Result<Self> {
        let (metadata, generator) = model::load(&checkpoint_file(path)?, choice)?;
        Ok(Self { metadata, generator })
    }

    /// The speaker's name.
    pub fn name(&self) -> &str {
        &self.metadata.name
    }

    /// The rate of the motion it makes.
    pub fn fps(&self) -> FrameRate {
        self.metadata.fps
    }

    /// Motion for `sound` (16 kHz): as many whole frames as fit into it, bones of the speaker's lengths. Errors on another
    /// rate, and on sound shorter than a frame.
    pub fn motion(&self, sound: &Sound) -> Result<Motion> {
        Ok(self.motion_and_posture(sound)?.0)
    }

    /// As `motion`, with the angles of head and trunk where they were learnt.
    pub fn motion_and_posture(&self, sound: &Sound) -> Result<(Motion, Option<Posture>)> {
        ensure!(sound.rate == SAMPLE_RATE, "the sound has {} Hz, expected {SAMPLE_RATE}", sound.rate);
        let pieces = sound.samples.chunks(SAMPLE_RATE as usize).map(|piece| Ok(piece.to_vec()));
        self.motion_of_pieces(pieces, sound.samples.len(), CHUNK, &mut |_| ())
    }

    /// Motion and posture for `n_samples` at 16 kHz that come piece by piece, made `chunk` frames at a time: memory does not grow with
    /// the sound, except for the motion. `made` is called with the number of frames of each chunk. Errors of `motion`,
    /// pieces that are not `n_samples` together, and a `chunk` that is no multiple of 32.
    pub fn motion_of_pieces(
        &self,
        pieces: impl Iterator<Item = Result<Vec<f32>>>,
        n_samples: usize,
        chunk: usize,
        made: &mut dyn FnMut(usize),
    ) -> Result<(Motion, Option<Posture>)> {
        let n_frames = self.n_frames(n_samples)?;
        let mut joints = Array3::zeros((n_frames, N_JOINTS, 3));
        let normal = &self.metadata.normalisation;
        let mut posture = (!normal.channels.is_empty()).then(|| Posture::unseen(n_frames));
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
            made(poses.ncols());
        }
        Ok((Motion::from_joints(self.fps(), joints), posture))
    }

    /// Raw output of the network for sound that comes as in [`Self::motion_of_pieces`], [numbers, T] of one chunk after another,
    /// `chunk` frames or less each, which [`SpeakerMetadata::motion`] turns into motion. The sound is continued by its
    /// mirror image up to a multiple of 32 frames.
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
                "the network makes numbers that are not finite from frame {first} on: its checkpoint was damaged, or its training failed"
            );
            Ok(Array2::from_shape_vec((self.metadata.network.n_out, n), poses)?)
        }))
    }

    /// Frames of motion for so many samples.
    pub fn n_frames(&self, n_samples: usize) -> Result<usize> {
        let secs = n_samples as f64 / f64::from(SAMPLE_RATE);
        let n_frames = (secs * self.fps().per_sec() + 1e-6) as usize;
        ensure!(n_frames > 0, "the sound is {secs:.3} s long: too short for one frame of motion");
        Ok(n_frames)
    }
}
