//! Smoothing before rotations are solved. Every bone's direction is smoothed as a vector in the axes of its parent
//! (trunk for arms, hand for fingers) and normalised again; a hand by its three angles relative to the forearm. Bones
//! keep their length, no angle jumps through half a turn, and the elbow's plane, which follows from smooth directions,
//! is less noisy than if it were smoothed itself. Gaps separate runs.

use crate::math::one_euro::OneEuro;
use crate::math::savitzky_golay::SavitzkyGolay;
use crate::math::vec3::{Vec3, unit};
use crate::types::time::FrameRate;

/// Smoothing method.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Smoothing {
    None,
    /// Cubic Savitzky-Golay filter over 0.6 s for arms (9 frames at 15 fps) and 1 s (15 frames) for hands, without
    /// delay.
    #[default]
    SavitzkyGolay,
    /// One-Euro filter (causal); hands with half of the cut-off at rest. Speeds are those of directions, radians a
    /// second.
    OneEuro(OneEuro),
}

/// Default parameters of the one-Euro filter.
pub const ONE_EURO: OneEuro = OneEuro { rest_hz: 1.5, beta: 0.5 };
/// Order of the polynomials.
const ORDER: usize = 3;
/// Half a window minus half a frame, seconds.
const ARMS_HALF_SECS: f64 = 4.0 / 15.0;
const HANDS_HALF_SECS: f64 = 7.0 / 15.0;
/// One-Euro cut-off of hands relative to that of arms.
const HANDS_SHARE: f64 = 0.5;

/// Filter for tracks of one rate.
pub enum Filter {
    None,
    Polynomial(SavitzkyGolay),
    OneEuro(OneEuro, f64),
}

impl Smoothing {
    /// Filter for trunk, head and arms at this rate.
    pub fn arms(self, fps: FrameRate) -> Filter {
        self.filter(fps, ARMS_HALF_SECS, 1.0)
    }

    /// Filter for hands and fingers at this rate.
    pub fn hands(self, fps: FrameRate) -> Filter {
        self.filter(fps, HANDS_HALF_SECS, HANDS_SHARE)
    }

    fn filter(self, fps: FrameRate, half_secs: f64, share: f64) -> Filter {
        match self {
            Self::None => Filter::None,
            Self::SavitzkyGolay => {
                let half = (half_secs * fps.per_sec()).round().clamp(1.0, 1000.0) as usize;
                Filter::Polynomial(SavitzkyGolay::new(half, ORDER))
            }
            Self::OneEuro(filter) => {
                Filter::OneEuro(OneEuro { rest_hz: share * filter.rest_hz, ..filter }, fps.per_sec())
            }
        }
    }
}

impl Filter {
    /// Smooths the directions of each run of seen frames; a frame whose neighbours cancel out gets no direction.
    pub fn directions(&self, track: &mut [Option<Vec3>]) {
        self.runs(track);
        track.iter_mut().for_each(|seen| *seen = seen.and_then(|v| unit(v, 1e-3)));
    }

    /// Smooths vectors of any length in each run of seen frames.
    pub fn runs(&self, track: &mut [Option<Vec3>]) {
        let mut start = 0;
        while start < track.len() {
            let run: Vec<Vec3> = track[start..].iter().map_while(|seen| *seen).collect();
            let smooth = match self {
                Self::None => return,
                Self::Polynomial(filter) => filter.run(&run),
                Self::OneEuro(filter, fps) => filter.run(*fps, &run),
            };
            track[start..].iter_mut().zip(smooth).for_each(|(place, value)| *place = Some(value));
            start += run.len() + 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_divides_and_the_window_keeps_its_time() {
        let mut track: Vec<Option<Vec3>> = (0..40).map(|t| Some([1.0, f64::from(t % 2), 0.0])).collect();
        track[20] = None;
        track[21..].iter_mut().flatten().for_each(|v| v[2] = 100.0);
        let fps = FrameRate::new(15, 1);
        Smoothing::default().arms(fps).runs(&mut track);
        assert!(track[20].is_none());
        assert!(track[..20].iter().flatten().all(|v| v[2].abs() < 1e-9));
        assert!(track[21..].iter().flatten().all(|v| (v[2] - 100.0).abs() < 1e-9));
        let window = |rate: u32| match Smoothing::default().arms(FrameRate::new(rate, 1)) {
            Filter::Polynomial(filter) => filter.window(),
            _ => 0,
        };
        assert_eq!([15, 30, 60].map(window), [9, 17, 33]);
    }
}
