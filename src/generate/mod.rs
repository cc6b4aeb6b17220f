//! Speech to motion with a trained speaker, chunk by chunk: memory does not grow with the sound.

use crate::audio::mel;
use crate::nn::chunks::Chunks;
use crate::nn::unet::FRAMES_MULTIPLE;
use crate::train::examples::mel_frames;
use crate::train::gan::BEST;
use crate::train::poses::N_NUMBERS;
use crate::train::speaker::{self, Facts, TrainedSpeaker};
use crate::types::pose3d::Motion;
use crate::types::sound::{SAMPLE_RATE, Sound};
use crate::types::time::FrameRate;
use anyhow::{Result, ensure};
use candle_core::{Device, Tensor};
use ndarray::{Array2, s};
use std::ops::Range;
use std::path::Path;

/// Frames made at once: with 256 more beside them that are thrown away, a small part.
const CHUNK: usize = 2048;

/// A trained speaker.
pub struct Speaker {
    trained: TrainedSpeaker,
}

impl From<TrainedSpeaker> for Speaker {
    fn from(trained: TrainedSpeaker) -> Self {
        Self { trained }
    }
}

impl Speaker {
    /// Opens a checkpoint of `orator train gan`: a file, or the folder of a training (its best checkpoint).
    pub fn open(path: &Path) -> Result<Self> {
        let file = if path.is_dir() { path.join(BEST) } else { path.to_owned() };
        ensure!(file.is_file(), "there is no checkpoint {}; `orator train gan` writes one", file.display());
        Ok(Self { trained: speaker::load(&file)? })
    }

    /// The speaker's name.
    pub fn name(&self) -> &str {
        &self.trained.facts.name
    }

    /// What its checkpoint says of it.
    pub fn facts(&self) -> &Facts {
        &self.trained.facts
    }

    /// The rate of the motion it makes.
    pub fn fps(&self) -> FrameRate {
        self.trained.facts.fps
    }

    /// Motion for `sound` (16 kHz): as many whole frames as fit into it, bones of the speaker's lengths. Sound of any
    /// length takes the same memory, but for itself and the motion. Errors on another rate, and on sound shorter than
    /// a frame.
    pub fn motion(&self, sound: &Sound) -> Result<Motion> {
        self.motion_with_chunk(sound, CHUNK)
    }

    /// The same in chunks of `chunk` frames, a multiple of 32.
    pub fn motion_with_chunk(&self, sound: &Sound, chunk: usize) -> Result<Motion> {
        let facts = &self.trained.facts;
        let mut numbers = Array2::zeros((N_NUMBERS, self.n_frames(sound)?));
        let mut first = 0;
        for poses in self.numbers(sound, chunk)? {
            let poses = poses?;
            numbers.slice_mut(s![.., first..first + poses.ncols()]).assign(&poses);
            first += poses.ncols();
        }
        Ok(facts.motion(numbers.view()))
    }

    /// What the network says for `sound`, [144, T] of one chunk after another, `chunk` frames or less each: raw numbers
    /// that the checkpoint's facts make into motion. The sound is continued by its mirror image up to a multiple of 32
    /// frames (rebol.md section 6).
    pub fn numbers<'a>(
        &'a self,
        sound: &'a Sound,
        chunk: usize,
    ) -> Result<impl Iterator<Item = Result<Array2<f32>>> + 'a> {
        let facts = &self.trained.facts;
        let n_frames = self.n_frames(sound)?;
        let padded = (n_frames / FRAMES_MULTIPLE + 1) * FRAMES_MULTIPLE;
        let n_mel_frames = mel_frames(facts.fps, padded);
        let mels = |frames| log_mels(&sound.samples, frames);
        let chunks = Chunks::new(&self.trained.generator, facts.network.preset, n_mel_frames, padded, chunk, mels)?;
        Ok(chunks.zip((0..n_frames).step_by(chunk)).map(move |(poses, first)| {
            let n = chunk.min(n_frames - first);
            let poses = poses?.narrow(2, 0, n)?.flatten_all()?.to_vec1()?;
            Ok(Array2::from_shape_vec((N_NUMBERS, n), poses)?)
        }))
    }

    fn n_frames(&self, sound: &Sound) -> Result<usize> {
        ensure!(sound.rate == SAMPLE_RATE, "the sound has {} Hz, expected {SAMPLE_RATE}", sound.rate);
        let n_frames = (sound.secs() * self.fps().per_sec() + 1e-6) as usize;
        ensure!(n_frames > 0, "the sound is {:.3} s long: too short for one frame of motion", sound.secs());
        Ok(n_frames)
    }
}

/// Spectrogram frames of the sound and its mirror images, [1, 64, T].
fn log_mels(samples: &[f32], frames: Range<usize>) -> candle_core::Result<Tensor> {
    let first = frames.start * mel::HOP;
    let mels = mel::log_mel(&mirrored(samples, first..first + mel::n_samples(frames.len())));
    let shape = (1, mel::N_MELS, frames.len());
    Tensor::from_iter(mels.t().iter().copied(), &Device::Cpu)?.reshape(shape)
}

/// These samples of the sound, then its mirror image, then the sound again, as long as needed.
fn mirrored(samples: &[f32], range: Range<usize>) -> Vec<f32> {
    let period = (2 * samples.len()).saturating_sub(2).max(1);
    let at = |i: usize| if i < samples.len() { i } else { period - i };
    range.map(|i| samples[at(i % period)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sound_is_mirrored_as_long_as_needed() {
        assert_eq!(mirrored(&[1.0, 2.0, 3.0], 0..8), [1.0, 2.0, 3.0, 2.0, 1.0, 2.0, 3.0, 2.0]);
        assert_eq!(mirrored(&[1.0], 0..3), [1.0, 1.0, 1.0]);
        assert_eq!(mirrored(&[1.0, 2.0, 3.0], 3..5), [2.0, 1.0]);
    }
}
