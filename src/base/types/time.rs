//! Time: frame rates as rational numbers, and the conversion from frame numbers to seconds.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Frames per second as an exact fraction in lowest terms (`30000/1001` is NTSC). Both parts are at least 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Fraction")]
pub struct FrameRate {
    pub num: u32,
    pub den: u32,
}

/// Error: frame rate outside the range of cameras and motion capture systems.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("invalid frame rate {0}: expected 1 to 1000 fps")]
pub struct ImplausibleRate(pub FrameRate);

/// Frame rate as stored in a file, where a part may be 0.
#[derive(Deserialize)]
struct Fraction {
    num: u32,
    den: u32,
}

impl TryFrom<Fraction> for FrameRate {
    type Error = String;

    fn try_from(Fraction { num, den }: Fraction) -> Result<Self, String> {
        if num == 0 || den == 0 {
            return Err(format!("invalid frame rate {num}/{den}: expected `num` and `den` of at least 1"));
        }
        Ok(Self::new(num, den))
    }
}

impl FrameRate {
    /// Rate of `num / den` frames per second in lowest terms; a zero part becomes 1, so that no rate divides by zero.
    pub const fn new(num: u32, den: u32) -> Self {
        let num = if num == 0 { 1 } else { num };
        let den = if den == 0 { 1 } else { den };
        let (mut divisor, mut rest) = (num, den);
        while rest != 0 {
            (divisor, rest) = (rest, divisor % rest);
        }
        Self { num: num / divisor, den: den / divisor }
    }

    /// Returns the simplest fraction within one part in 100 000 of a decimal: an integer, NTSC (hundreds over 1001),
    /// thousandths, or else ten-thousandths. `None` outside 0.01..=100 000.
    pub fn nearest(per_sec: f64) -> Option<Self> {
        if !(0.01..=100_000.0).contains(&per_sec) {
            return None;
        }
        let over = |den: u32| ((per_sec * f64::from(den)).round() as u32, den);
        let is_meant = |&(num, den): &(u32, u32)| {
            let is_near = (f64::from(num) / f64::from(den) / per_sec - 1.0).abs() < 1e-5;
            is_near && (den != 1001 || num.is_multiple_of(100))
        };
        let (num, den) = [over(1), over(1001), over(1000)].into_iter().find(is_meant).unwrap_or(over(10_000));
        Some(Self::new(num, den))
    }

    /// Returns whether a camera or a motion capture system can have this rate: 1 to 1000 frames per second.
    pub fn is_plausible(self) -> bool {
        (1.0..=1000.0).contains(&self.per_sec())
    }

    /// Returns the rate.
    ///
    /// # Errors
    /// The rate is not plausible.
    pub fn checked(self) -> Result<Self, ImplausibleRate> {
        if self.is_plausible() { Ok(self) } else { Err(ImplausibleRate(self)) }
    }

    /// Rate in frames per second.
    pub fn per_sec(self) -> f64 {
        f64::from(self.num) / f64::from(self.den)
    }

    /// Presentation time of frame `frame_idx` in seconds; frame 0 is at 0.
    pub fn secs(self, frame_idx: usize) -> f64 {
        frame_idx as f64 * f64::from(self.den) / f64::from(self.num)
    }

    /// Number of frames that start within `secs` seconds: the first n with `n / rate >= secs`.
    pub fn frames_in(self, secs: f64) -> usize {
        let frames = secs * self.per_sec();
        (frames - 1e-6).ceil().max(0.0) as usize
    }
}

/// Parses `15`, `29.97` (meaning 30000/1001) or `30000/1001`, each with or without ` fps`; 1 to 1000 frames per second.
impl FromStr for FrameRate {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = text.trim().trim_end_matches("fps").trim_end();
        let rate = match number.split_once('/') {
            Some((num, den)) => match (num.trim().parse(), den.trim().parse()) {
                (Ok(num), Ok(den)) if num > 0 && den > 0 => Some(Self::new(num, den)),
                _ => None,
            },
            None => number.parse().ok().and_then(Self::nearest),
        };
        rate.filter(|rate| rate.is_plausible())
            .ok_or_else(|| format!("invalid frame rate `{text}`: expected 1 to 1000 fps, e.g. 15, 29.97 or 30000/1001"))
    }
}

impl fmt::Display for FrameRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.den == 1 { write!(f, "{} fps", self.num) } else { write!(f, "{}/{} fps", self.num, self.den) }
    }
}
