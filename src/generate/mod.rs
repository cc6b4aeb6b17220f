//! Speech to motion with a trained speaker: any length of sound in one pass.

use crate::audio::mel;
use crate::nn::unet::FRAMES_MULTIPLE;
use crate::train::examples::mel_frames;
use crate::train::gan::BEST;
use crate::train::poses::N_NUMBERS;
use crate::train::speaker::{self, TrainedSpeaker};
use crate::types::pose3d::Motion;
use crate::types::sound::{SAMPLE_RATE, Sound};
use crate::types::time::FrameRate;
use anyhow::{Result, ensure};
use candle_core::{Device, Tensor};
use ndarray::ArrayView2;
use std::path::Path;

/// A trained speaker.
pub struct Speaker {
    trained: TrainedSpeaker,
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

    /// The rate of the motion it makes.
    pub fn fps(&self) -> FrameRate {
        self.trained.facts.fps
    }

    /// Motion for `sound` (16 kHz): as many whole frames as fit into it, bones of the speaker's lengths. The sound is
    /// continued by its mirror image up to a multiple of 32 frames (rebol.md section 6). Errors on another rate, and
    /// on sound shorter than a frame.
    pub fn motion(&self, sound: &Sound) -> Result<Motion> {
        let facts = &self.trained.facts;
        ensure!(sound.rate == SAMPLE_RATE, "the sound has {} Hz, expected {SAMPLE_RATE}", sound.rate);
        let n_frames = (sound.secs() * facts.fps.per_sec() + 1e-6) as usize;
        ensure!(n_frames > 0, "the sound is {:.3} s long: too short for one frame of motion", sound.secs());
        let padded = (n_frames / FRAMES_MULTIPLE + 1) * FRAMES_MULTIPLE;
        let samples = mirrored(&sound.samples, mel::n_samples(mel_frames(facts.fps, padded)));
        let mels = mel::log_mel(&samples).reversed_axes().as_standard_layout().into_owned();
        let shape = (1, mels.nrows(), mels.ncols());
        let mels = Tensor::from_vec(mels.into_raw_vec_and_offset().0, shape, &Device::Cpu)?;
        let poses = self.trained.generator.forward(&mels, padded, false)?.narrow(2, 0, n_frames)?;
        let poses = poses.flatten_all()?.to_vec1::<f32>()?;
        Ok(facts.normalisation.motion(ArrayView2::from_shape((N_NUMBERS, n_frames), &poses)?, facts.fps))
    }
}

/// `n` samples: the sound, then its mirror image, then the sound again, as long as needed.
fn mirrored(samples: &[f32], n: usize) -> Vec<f32> {
    let period = (2 * samples.len()).saturating_sub(2).max(1);
    let at = |i: usize| if i < samples.len() { i } else { period - i };
    (0..n).map(|i| samples[at(i % period)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sound_is_mirrored_as_long_as_needed() {
        assert_eq!(mirrored(&[1.0, 2.0, 3.0], 8), [1.0, 2.0, 3.0, 2.0, 1.0, 2.0, 3.0, 2.0]);
        assert_eq!(mirrored(&[1.0], 3), [1.0, 1.0, 1.0]);
        assert_eq!(mirrored(&[1.0, 2.0, 3.0], 2), [1.0, 2.0]);
    }
}
