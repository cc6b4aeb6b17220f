//! Resampling of motion to another frame rate. Downsampling first applies a low-pass filter (a Kaiser-windowed sinc of
//! linear phase) against aliasing; upsampling interpolates with the same sinc. Frame n of the result is at exactly n /
//! fps seconds after the source's first frame. At the source's own rate the motion is returned unchanged.

use crate::math::runs::true_ranges;
use crate::types::pose3d::Motion;
use crate::types::skeleton::N_JOINTS;
use crate::types::time::FrameRate;
use ndarray::{Array2, Array3};
use std::ops::Range;

/// Half width of the kernel, in periods of the slower rate.
const HALF_WIDTH: f64 = 8.0;
/// Shape parameter of the Kaiser window: side lobes of -60 dB.
const BETA: f64 = 6.0;
/// Frequency of half amplitude, as a fraction of half the slower rate: everything from half the rate on, which would
/// alias, is below -60 dB, and frequencies below 0.62 of it (4.6 Hz at 15 frames per second) are unchanged.
const CUTOFF: f64 = 0.81;

/// Resamples the motion to `fps`. A joint is missing where the source's joint is missing at that time, and masked if
/// it is masked in a neighbouring frame of the source.
pub fn at_rate(motion: &Motion, fps: FrameRate) -> Motion {
    let from = motion.fps;
    if u64::from(from.num) * u64::from(fps.den) == u64::from(fps.num) * u64::from(from.den) {
        return motion.clone();
    }
    let n_source = motion.n_frames();
    let last_secs = from.secs(n_source.saturating_sub(1));
    let n_frames = if n_source == 0 { 0 } else { (last_secs * fps.per_sec() + 1e-6).floor() as usize + 1 };
    let mut joints = Array3::from_elem((n_frames, N_JOINTS, 3), f32::NAN);
    let mut mask = Array2::from_elem((n_frames, N_JOINTS), false);
    // One kernel per frame of the result, shared by all joints.
    let kernels: Vec<ResamplingKernel> =
        (0..n_frames).map(|n| ResamplingKernel::at(fps.secs(n) * from.per_sec(), from, fps)).collect();
    for joint in 0..N_JOINTS {
        let is_visible = |frame: usize| motion.mask[[frame.min(n_source - 1), joint]];
        let exists = |t: usize| (0..3).all(|k| motion.joints[[t, joint, k]].is_finite());
        let exists: Vec<bool> = (0..n_source).map(exists).collect();
        for Range { start, end } in true_ranges(&exists) {
            let tracks: [Vec<f64>; 3] =
                std::array::from_fn(|k| (start..end).map(|t| f64::from(motion.joints[[t, joint, k]])).collect());
            for (n, kernel) in kernels.iter().enumerate() {
                let (below, above) = (kernel.time.floor() as usize, kernel.time.ceil() as usize);
                if below < start || above >= end {
                    continue;
                }
                for (k, track) in tracks.iter().enumerate() {
                    joints[[n, joint, k]] = kernel.apply(track, start) as f32;
                }
                mask[[n, joint]] = is_visible(below) && is_visible(above);
            }
        }
    }
    Motion { fps, joints, mask }
}

/// Weights of the source frames around one point in time.
struct ResamplingKernel {
    /// Point in time, in frames of the source.
    time: f64,
    first: i64,
    weights: Vec<f64>,
}

impl ResamplingKernel {
    fn at(time: f64, from: FrameRate, to: FrameRate) -> Self {
        // Times that coincide with a frame of the source are exact.
        let time = if (time - time.round()).abs() < 1e-6 { time.round() } else { time };
        let slower = (to.per_sec() / from.per_sec()).min(1.0);
        let cutoff = if slower < 1.0 { CUTOFF * slower } else { 1.0 };
        let half = HALF_WIDTH / slower;
        let (first, last) = ((time - half).ceil() as i64, (time + half).floor() as i64);
        let weight = |frame: i64| {
            let d = frame as f64 - time;
            let x = std::f64::consts::PI * cutoff * d;
            let sinc = if x.abs() < 1e-9 { 1.0 } else { x.sin() / x };
            sinc * bessel_0(BETA * (1.0 - (d / half).powi(2)).max(0.0).sqrt())
        };
        let mut weights: Vec<f64> = (first..=last).map(weight).collect();
        // A linear correction of the weights: linear motion is reproduced exactly at any time between two frames.
        let moment = |weights: &[f64], power: i32| -> f64 {
            weights.iter().zip(first..).map(|(w, frame)| w * (frame as f64 - time).powi(power)).sum()
        };
        let (m0, m1, m2) = (moment(&weights, 0), moment(&weights, 1), moment(&weights, 2));
        let determinant = m0 * m2 - m1 * m1;
        for (w, frame) in weights.iter_mut().zip(first..) {
            let d = frame as f64 - time;
            *w *= if determinant.abs() > 1e-9 * m0 * m0 { (m2 - m1 * d) / determinant } else { 1.0 / m0 };
        }
        Self { time, first, weights }
    }

    /// Filters a track whose first value is frame `start`. Beyond its ends the track is continued by point reflection,
    /// which reproduces linear motion.
    fn apply(&self, track: &[f64], start: usize) -> f64 {
        let last = track.len() as i64 - 1;
        let value = |frame: i64| {
            let at = frame - start as i64;
            let read = |i: i64| track.get(i.clamp(0, last) as usize).copied().unwrap_or_default();
            match at {
                at if at < 0 => 2.0 * read(0) - read(-at),
                at if at > last => 2.0 * read(last) - read(2 * last - at),
                at => read(at),
            }
        };
        self.weights.iter().zip(self.first..).map(|(w, frame)| w * value(frame)).sum()
    }
}

/// Modified Bessel function of the first kind of order 0, by its series.
fn bessel_0(x: f64) -> f64 {
    let (mut sum, mut term, mut k) = (1.0, 1.0, 1.0);
    while term > 1e-12 * sum {
        term *= (x / (2.0 * k)).powi(2);
        sum += term;
        k += 1.0;
    }
    sum
}
