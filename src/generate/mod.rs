//! Speech to motion with a trained speaker, the whole sound in one pass.

use crate::audio::mel;
use crate::nn::unet::{Config, FRAMES_MULTIPLE, Preset};
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

/// Memory the preset `paper` takes for a second of sound at its full width of 256, bytes, as measured: its first
/// layers keep 64 channels of every band of the spectrogram.
const PAPER_BYTES_A_SEC: f64 = 5.5e6;
/// Sound that would take more memory is refused, bytes.
const MOST_BYTES: f64 = 8e9;

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
    /// continued by its mirror image up to a multiple of 32 frames (rebol.md section 6). Memory grows with the sound:
    /// for an hour about 1.5 GB with the preset `light`, 20 GB with `paper`. Errors on another rate, on sound shorter
    /// than a frame, and on sound too long for `paper`.
    pub fn motion(&self, sound: &Sound) -> Result<Motion> {
        let facts = &self.trained.facts;
        ensure!(sound.rate == SAMPLE_RATE, "the sound has {} Hz, expected {SAMPLE_RATE}", sound.rate);
        let n_frames = (sound.secs() * facts.fps.per_sec() + 1e-6) as usize;
        ensure!(n_frames > 0, "the sound is {:.3} s long: too short for one frame of motion", sound.secs());
        check_length(&facts.network, sound.secs())?;
        let padded = (n_frames / FRAMES_MULTIPLE + 1) * FRAMES_MULTIPLE;
        let samples = mirrored(&sound.samples, mel::n_samples(mel_frames(facts.fps, padded)));
        let mels = mel::log_mel(&samples).reversed_axes().as_standard_layout().into_owned();
        drop(samples);
        let shape = (1, mels.nrows(), mels.ncols());
        let mels = Tensor::from_vec(mels.into_raw_vec_and_offset().0, shape, &Device::Cpu)?;
        let poses = self.trained.generator.forward(&mels, padded, false)?.narrow(2, 0, n_frames)?;
        let poses = poses.flatten_all()?.to_vec1::<f32>()?;
        Ok(facts.motion(ArrayView2::from_shape((N_NUMBERS, n_frames), &poses)?))
    }
}

/// Errors where the network would need more memory than is sane for so many seconds.
fn check_length(network: &Config, secs: f64) -> Result<()> {
    if network.preset == Preset::Light {
        return Ok(());
    }
    let bytes_a_sec = PAPER_BYTES_A_SEC * network.width as f64 / 256.0;
    ensure!(
        secs * bytes_a_sec <= MOST_BYTES,
        "{:.0} minutes of sound would take about {:.0} GB of memory with this speaker (preset `paper`): cut the sound \
         into pieces of at most {:.0} minutes, or train a speaker with gan.preset = \"light\"",
        secs / 60.0,
        secs * bytes_a_sec / 1e9,
        (MOST_BYTES / bytes_a_sec / 60.0).floor()
    );
    Ok(())
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
    fn an_hour_is_too_long_for_the_published_network_only() {
        let of = |preset| Config::of(preset, N_NUMBERS);
        check_length(&of(Preset::Light), 36_000.0).unwrap();
        check_length(&of(Preset::Paper), 600.0).unwrap();
        let text = check_length(&of(Preset::Paper), 3_600.0).unwrap_err().to_string();
        assert!(text.contains("20 GB") && text.contains("24 minutes") && text.contains("light"), "{text}");
    }

    #[test]
    fn sound_is_mirrored_as_long_as_needed() {
        assert_eq!(mirrored(&[1.0, 2.0, 3.0], 8), [1.0, 2.0, 3.0, 2.0, 1.0, 2.0, 3.0, 2.0]);
        assert_eq!(mirrored(&[1.0], 3), [1.0, 1.0, 1.0]);
        assert_eq!(mirrored(&[1.0, 2.0, 3.0], 2), [1.0, 2.0]);
    }
}
