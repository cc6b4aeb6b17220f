//! Smoothing before rotations are solved. The direction of each bone is smoothed as a vector in the axes of its parent
//! (trunk for arms, hand for fingers) and normalised; a hand is smoothed as three angles relative to the forearm. Bones
//! keep their length, no angle jumps by half a turn, and the elbow plane, derived from smooth directions, is less noisy
//! than if it were smoothed itself. Gaps separate runs.

use orator_base::math::local_fit::LocalFit;
use orator_base::math::savitzky_golay::SavitzkyGolay;
use orator_base::math::vec3::{Vec3, unit};
use orator_base::types::time::FrameRate;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Smoothing {
    None,
    /// Local fits whose width adapts to the noise of each bone in the clip. With `strength` 1 a noise-free motion
    /// changes by at most a few millimetres; `strength` scales the noise and that tolerance, and 0 removes nothing.
    Adaptive {
        strength: f64,
    },
    /// Zero-phase cubic Savitzky-Golay filter over 0.6 s for arms (9 frames at 15 fps) and 1 s (15 frames) for hands.
    SavitzkyGolay,
}

impl Default for Smoothing {
    fn default() -> Self {
        Self::Adaptive { strength: 1.0 }
    }
}

/// Order of the polynomials.
const ORDER: usize = 3;
/// Half a window minus half a frame, seconds.
const ARMS_HALF_SECS: f64 = 4.0 / 15.0;
const HANDS_HALF_SECS: f64 = 7.0 / 15.0;
/// Tolerances of the adaptive filter, radians: 1.5 mm at the end of an upper arm or forearm, 1 mm at the end of a hand,
/// 0.6 mm at the end of a phalanx.
const ARMS_RADIANS: f64 = 0.005;
const HANDS_RADIANS: f64 = 0.006;
const FINGERS_RADIANS: f64 = 0.015;

/// Filter for tracks at one frame rate.
pub enum Filter {
    None,
    Adaptive(LocalFit),
    Polynomial(SavitzkyGolay),
}

impl Smoothing {
    pub fn arms(self, fps: FrameRate) -> Filter {
        self.filter(fps, ARMS_HALF_SECS, ARMS_RADIANS)
    }

    /// Filter for hand angles relative to the forearm, radians.
    pub fn hands(self, fps: FrameRate) -> Filter {
        self.filter(fps, HANDS_HALF_SECS, HANDS_RADIANS)
    }

    pub fn fingers(self, fps: FrameRate) -> Filter {
        self.filter(fps, HANDS_HALF_SECS, FINGERS_RADIANS)
    }

    fn filter(self, fps: FrameRate, half_secs: f64, tolerance: f64) -> Filter {
        match self {
            Self::None => Filter::None,
            Self::Adaptive { strength } => {
                Filter::Adaptive(LocalFit::new(fps.per_sec(), strength, strength * tolerance))
            }
            Self::SavitzkyGolay => {
                let half = (half_secs * fps.per_sec()).round().clamp(1.0, 1000.0) as usize;
                Filter::Polynomial(SavitzkyGolay::new(half, ORDER))
            }
        }
    }
}

impl Filter {
    /// Smooths the directions in each run of detected frames; a frame whose neighbours cancel out gets no direction.
    pub fn directions(&self, track: &mut [Option<Vec3>], known: &[f64]) {
        self.runs(track, known);
        track.iter_mut().for_each(|seen| *seen = seen.and_then(|v| unit(v, 1e-3)));
    }

    /// Smooths vectors in each run of detected frames. `known`: standard deviation of the noise by frame, or empty.
    pub fn runs(&self, track: &mut [Option<Vec3>], known: &[f64]) {
        let mut start = 0;
        while start < track.len() {
            let run: Vec<Vec3> = track[start..].iter().map_while(|seen| *seen).collect();
            let smooth = match self {
                Self::None => return,
                Self::Adaptive(filter) => filter.run(&run, known.get(start..).unwrap_or_default()),
                Self::Polynomial(filter) => filter.run(&run),
            };
            track[start..].iter_mut().zip(smooth).for_each(|(place, value)| *place = Some(value));
            start += run.len() + 1;
        }
    }
}
