//! Sound in memory and its alignment with frames: the offset between sound and picture, and the samples of a frame.
//! Frame `n` begins at `n / fps` seconds; only this file converts frame counts to sample counts.

use super::time::FrameRate;
use crate::text::length;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::Range;

/// Sample rate of all sound inside the pipeline, Hz.
pub const SAMPLE_RATE: u32 = 16_000;
/// Minimum confidence of a reliable offset.
const SURE: f64 = 0.99;
/// Minimum offset that is reported; a smaller one is not noticeable.
const MIN_REPORTED_SECS: f64 = 0.04;
/// Upper limit of a reliable offset: at this value the true offset may exceed the range of lags that was searched.
const MAX_SECS: f64 = 0.72;

/// Mono sound.
#[derive(Clone, Debug, PartialEq)]
pub struct Sound {
    /// Sample rate in Hz.
    pub rate: u32,
    /// Amplitudes, -1..1.
    pub samples: Vec<f32>,
}

impl Sound {
    pub fn secs(&self) -> f64 {
        self.samples.len() as f64 / f64::from(self.rate.max(1))
    }
}

/// Audio tracks of a file, and the selected one.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AudioTracks {
    pub n_tracks: usize,
    /// Number of the selected track, from 1.
    #[serde(rename = "taken")]
    pub selected: usize,
    /// Language of each track as named in the file; empty if not named.
    pub languages: Vec<String>,
}

/// Note on stereo whose channels cancel out for `secs` seconds; `None` if they do not.
pub fn opposite_phase_note(secs: f64) -> Option<String> {
    let length = length(secs);
    (secs > 0.0).then(|| format!("stereo channels of opposite phase for {length}: only the louder one is used there"))
}

/// Delay of the sound of a video relative to the picture, measured from the speaker's lips.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SoundOffset {
    /// Delay in seconds; negative if the sound is early.
    pub secs: f64,
    /// Correlation of lips and voice at this delay.
    pub correlation: f64,
    /// Probability that the sound of another voice correlates less at every lag, 0..1.
    pub confidence: f64,
    /// Seconds with both a visible mouth and speech.
    pub compared_secs: f64,
}

impl SoundOffset {
    /// Returns whether the offset is reliable enough to shift the sound by it.
    pub fn is_reliable(&self) -> bool {
        self.confidence >= SURE && self.secs.abs() < MAX_SECS
    }

    /// Returns whether to report the offset: it is reliable and not shorter than one frame at 25 fps.
    pub fn is_reportable(&self) -> bool {
        self.is_reliable() && self.secs.abs() >= MIN_REPORTED_SECS
    }
}

impl fmt::Display for SoundOffset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let late = if self.secs < 0.0 { "early" } else { "late" };
        let certainty = if self.is_reliable() { "reliable" } else { "uncertain" };
        write!(f, "audio is {:.0} ms {late} ({certainty})", 1000.0 * self.secs.abs())
    }
}

/// First sample of frame `frame_idx`: `round(frame_idx / fps * rate)`, halves rounded up, in integer arithmetic.
pub fn sample_at(fps: FrameRate, rate: u32, frame_idx: usize) -> usize {
    let (num, den) = (u128::from(fps.num.max(1)), u128::from(fps.den));
    ((2 * frame_idx as u128 * den * u128::from(rate) + num) / (2 * num)) as usize
}

/// Returns the samples of `frames`; adjacent ranges of frames have adjacent ranges of samples.
pub fn samples_of(fps: FrameRate, rate: u32, frames: Range<usize>) -> Range<usize> {
    sample_at(fps, rate, frames.start)..sample_at(fps, rate, frames.end)
}
