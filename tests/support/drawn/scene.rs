//! Clip of the synthetic speaker: speech, gestures and camera from one seed.

use super::camera::DemoCamera;
use super::figure::DrawnFigure;
use super::gesture::DrawnGestures;
use super::paint;
use super::speech::Speech;
use orator_base::stage::progress::Progress;
use orator_base::types::image::Image;
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_media::ffmpeg::write::encode::VideoWriter;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

/// Clip of `secs` seconds.
pub struct DrawnScene {
    pub secs: f64,
    pub camera: DemoCamera,
    seed: u64,
    speech: Speech,
    gestures: DrawnGestures,
}

impl DrawnScene {
    /// Creates the clip of a seed; the camera is slightly to the side and above.
    pub fn new(seed: u64, secs: f64, size: [usize; 2]) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let speech = Speech::new(secs, &mut rng);
        let gestures = DrawnGestures::new(&speech, &mut rng);
        let camera = DemoCamera::new(
            size,
            rng.random_range(-0.12..0.12),
            rng.random_range(0.03..0.12),
            rng.random_range(1.85..2.0),
        );
        Self { secs, camera, seed, speech, gestures }
    }

    /// Figure at a time, in world coordinates.
    pub fn figure(&self, secs: f64) -> DrawnFigure {
        DrawnFigure::new(&self.gestures.controls(secs))
    }

    /// Picture at a time.
    pub fn picture(&self, secs: f64) -> anyhow::Result<Image> {
        paint::picture(&self.figure(secs), &self.camera, self.speech.loudness(secs))
    }

    /// Audio of the clip.
    pub fn sound(&self) -> Sound {
        self.speech.sound(self.secs, &mut ChaCha8Rng::seed_from_u64(self.seed ^ 0x50EA))
    }

    /// Writes the clip as a video at `fps`.
    pub fn film(&self, path: &Path, fps: FrameRate, progress: &dyn Progress) -> anyhow::Result<()> {
        let n_frames = fps.frames_in(self.secs);
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let task = progress.begin(&format!("draw {name}"), n_frames as u64);
        let mut video = VideoWriter::create(path, self.camera.width, self.camera.height, fps, Some(&self.sound()))?;
        for frame_idx in 0..n_frames {
            video.push(&self.picture(fps.secs(frame_idx))?)?;
            task.advance(1);
        }
        video.finish()
    }
}
