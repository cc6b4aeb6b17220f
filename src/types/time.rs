//! Time: frame rates as rationals and the one rule that turns a frame number into seconds.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Frames a second as an exact fraction (`30000/1001` is NTSC). Both parts are at least 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Parts")]
pub struct FrameRate {
    pub num: u32,
    pub den: u32,
}

/// A rate as it stands in a file, where a part may be 0.
#[derive(Deserialize)]
struct Parts {
    num: u32,
    den: u32,
}

impl From<Parts> for FrameRate {
    fn from(Parts { num, den }: Parts) -> Self {
        Self::new(num, den)
    }
}

impl FrameRate {
    /// `num / den` frames a second; a zero part becomes 1, so that no rate divides by zero.
    pub const fn new(num: u32, den: u32) -> Self {
        let num = if num == 0 { 1 } else { num };
        let den = if den == 0 { 1 } else { den };
        Self { num, den }
    }

    /// The rate in frames a second.
    pub fn per_sec(self) -> f64 {
        f64::from(self.num) / f64::from(self.den)
    }

    /// Presentation time of frame `frame_idx` in seconds, counted from frame 0.
    pub fn secs(self, frame_idx: usize) -> f64 {
        frame_idx as f64 * f64::from(self.den) / f64::from(self.num)
    }

    /// How many frames lie wholly or partly inside `secs` seconds: the first n with `n / rate >= secs`.
    pub fn frames_in(self, secs: f64) -> usize {
        let frames = secs * self.per_sec();
        (frames - 1e-6).ceil().max(0.0) as usize
    }
}

impl fmt::Display for FrameRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.den == 1 { write!(f, "{} fps", self.num) } else { write!(f, "{}/{} fps", self.num, self.den) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_and_seconds_agree() {
        let ntsc = FrameRate::new(30_000, 1_001);
        assert_eq!(ntsc.frames_in(ntsc.secs(600)), 600);
        assert_eq!(FrameRate::new(15, 1).frames_in(2.01), 31);
        assert_eq!(FrameRate::new(0, 0).per_sec(), 1.0);
    }

    #[test]
    fn no_file_makes_a_rate_without_parts() {
        let read = |text| serde_json::from_str::<FrameRate>(text).unwrap();
        assert_eq!(read("{\"num\":0,\"den\":0}"), FrameRate::new(1, 1));
        let ntsc = FrameRate::new(30_000, 1_001);
        assert_eq!(read(&serde_json::to_string(&ntsc).unwrap()), ntsc);
    }
}
