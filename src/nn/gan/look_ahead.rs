//! Limited look-ahead, for gestures to speech that is not over yet: the UNet reads only earlier frames (zeros
//! before the input of its convolutions, repeated frames delayed by one), and the sound is moved so that the audio encoder
//! ends its view at the chosen time. The audio encoder itself is unchanged.

use super::generator::Preset;
use super::streaming::{HOPS, audio_after};
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LookAhead {
    /// Seconds of sound after a pose frame on which the pose depends.
    pub secs: f64,
    /// Number of spectrogram frames by which the sound is moved to earlier times; negative: to later ones.
    pub shift: i64,
    /// Results of the audio encoder per pose frame, as numerator and denominator. A fixed ratio, as the length of the
    /// sound is unknown.
    pub encoded_per_frame: (usize, usize),
}

impl LookAhead {
    /// Look-ahead of `secs` seconds for a network with `mels_per_frame` spectrogram frames per pose frame
    /// (numerator and denominator), `mels_per_sec` per second, each of `window` frames of sound.
    pub fn new(preset: Preset, secs: f64, mels_per_frame: (usize, usize), mels_per_sec: f64, window: f64) -> Self {
        // A pose is interpolated between two results of the encoder, and the second may be one further.
        let reach = (HOPS + audio_after(preset)) as f64 + window;
        let shift = (secs * mels_per_sec - reach + 1e-9).floor() as i64;
        Self { secs, shift, encoded_per_frame: (mels_per_frame.0, mels_per_frame.1 * HOPS) }
    }
}
