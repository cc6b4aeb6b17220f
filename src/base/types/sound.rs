//! Sound in memory, and how it meets frames: by how much they are apart, and the samples that belong to a frame. Frame `n`
//! begins at `n / fps` seconds; sample counts are never derived from frame counts in any other place.

use super::time::FrameRate;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::Range;

/// The rate of all sound inside the pipeline, in samples a second.
pub const SAMPLE_RATE: u32 = 16_000;
/// Confidence from which an offset is sure.
const SURE: f64 = 0.99;
/// An offset below is none that anybody sees; one beyond the other may be greater still than any lag that was tried.
const TOLD_SECS: f64 = 0.04;
const FARTHEST_SECS: f64 = 0.72;

/// Mono samples in -1..1 at `rate` samples a second.
#[derive(Clone, Debug, PartialEq)]
pub struct Sound {
    /// Samples a second.
    pub rate: u32,
    /// Amplitudes, -1..1.
    pub samples: Vec<f32>,
}

impl Sound {
    /// Length in seconds.
    pub fn secs(&self) -> f64 {
        self.samples.len() as f64 / f64::from(self.rate.max(1))
    }
}

/// Sound tracks of a file, and the one taken.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AudioTracks {
    pub n_tracks: usize,
    /// Number of the track, from 1.
    pub taken: usize,
    /// Language of each, as the file names it; empty: not named.
    pub languages: Vec<String>,
}

/// How much later the sound of a video is than its picture, as the lips of the person seen say.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SoundOffset {
    /// Seconds; negative: the sound is early.
    pub secs: f64,
    /// Correlation of lips and voice at that offset.
    pub correlation: f64,
    /// Probability that the sound of another voice matches less well at every lag, 0..1.
    pub confidence: f64,
    /// Seconds with both a visible mouth and speech.
    pub compared_secs: f64,
}

impl SoundOffset {
    /// Whether the sound may be shifted by it.
    pub fn is_sure(&self) -> bool {
        self.confidence >= SURE && self.secs.abs() < FARTHEST_SECS
    }

    /// Whether to report the offset: it is sure, and longer than one frame of film.
    pub fn is_told(&self) -> bool {
        self.is_sure() && self.secs.abs() >= TOLD_SECS
    }
}

impl fmt::Display for SoundOffset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let late = if self.secs < 0.0 { "early" } else { "late" };
        let sure = if self.is_sure() { "sure" } else { "not sure" };
        write!(f, "sound is {:.0} ms {late} ({sure})", 1000.0 * self.secs.abs())
    }
}

/// The sample at which frame `frame_idx` begins: `round(frame_idx / fps * rate)`, halves upwards, in whole numbers.
pub fn sample_at(fps: FrameRate, rate: u32, frame_idx: usize) -> usize {
    let (num, den) = (u128::from(fps.num.max(1)), u128::from(fps.den));
    ((2 * frame_idx as u128 * den * u128::from(rate) + num) / (2 * num)) as usize
}

/// The samples of `frames`; neighbouring ranges of frames have neighbouring ranges of samples.
pub fn samples_of(fps: FrameRate, rate: u32, frames: Range<usize>) -> Range<usize> {
    sample_at(fps, rate, frames.start)..sample_at(fps, rate, frames.end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sound_and_frames_meet_by_time() {
        let fps = FrameRate::new(15, 1);
        assert_eq!(samples_of(fps, 16_000, 0..15), 0..16_000);
        assert_eq!(sample_at(fps, 16_000, 1), 1_067);
        let ntsc = FrameRate::new(15_000, 1_001);
        for frame in 0..2_000 {
            let exact = ntsc.secs(frame) * 16_000.0;
            assert!((sample_at(ntsc, 16_000, frame) as f64 - exact).abs() <= 0.5 + 1e-6);
        }
        assert_eq!(sample_at(fps, 16_000, 15 * 3_600 * 24), 16_000 * 3_600 * 24);
    }

    #[test]
    fn an_offset_says_what_is_late_and_whether_that_is_sure() {
        let offset = SoundOffset { secs: 0.12, correlation: 0.5, confidence: 0.999, compared_secs: 60.0 };
        assert_eq!((offset.to_string().as_str(), offset.is_told()), ("sound is 120 ms late (sure)", true));
        let offset = SoundOffset { secs: -0.02, confidence: 0.5, ..offset };
        assert_eq!((offset.to_string().as_str(), offset.is_told()), ("sound is 20 ms early (not sure)", false));
        assert!(!SoundOffset { secs: 0.73, confidence: 1.0, ..offset }.is_sure());
    }
}
