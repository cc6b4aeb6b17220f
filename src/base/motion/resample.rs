//! Resampling of motion to another frame rate. Downsampling first applies a low-pass filter (a Kaiser-windowed sinc of
//! linear phase) against aliasing; upsampling interpolates with the same sinc. Frame n of the result is at exactly n /
//! fps seconds after the source's first frame. At the source's own rate the motion is returned unchanged.

use crate::types::pose3d::Motion;
use crate::types::skeleton::N_JOINTS;
use crate::types::time::FrameRate;
use ndarray::{Array2, Array3};

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
        for (start, end) in runs(motion, joint) {
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

/// Returns the ranges of frames in which a joint exists.
fn runs(motion: &Motion, joint: usize) -> Vec<(usize, usize)> {
    let exists = |t: usize| (0..3).all(|k| motion.joints[[t, joint, k]].is_finite());
    let exists: Vec<bool> = (0..motion.n_frames()).map(exists).collect();
    let mut end = 0;
    let runs = exists.chunk_by(|a, b| a == b).map(|run| {
        let start = end;
        end += run.len();
        (run[0], start, end)
    });
    runs.filter(|(exists, ..)| *exists).map(|(_, start, end)| (start, end)).collect()
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Joint 1 oscillates along x at `hz` for `secs` seconds.
    fn swing(fps: FrameRate, secs: f64, hz: f64) -> Motion {
        let n = (secs * fps.per_sec()).round() as usize;
        let joints = Array3::from_shape_fn((n, N_JOINTS, 3), |(t, j, k)| {
            if j == 1 && k == 0 { (TAU * hz * fps.secs(t)).sin() as f32 } else { 0.0 }
        });
        Motion::from_joints(fps, joints)
    }

    /// Maximum amplitude in the middle of the resampled motion, and maximum deviation from the original oscillation.
    fn measured(from: (u32, u32), to: u32, hz: f64) -> (f64, f64) {
        let motion = at_rate(&swing(FrameRate::new(from.0, from.1), 8.0, hz), FrameRate::new(to, 1));
        let middle = motion.n_frames() / 4..motion.n_frames() * 3 / 4;
        let value = |t: usize| f64::from(motion.joints[[t, 1, 0]]);
        let truth = |t: usize| (TAU * hz * motion.fps.secs(t)).sin();
        let largest = |of: &dyn Fn(usize) -> f64| middle.clone().map(of).fold(0.0, f64::max);
        (largest(&|t| value(t).abs()), largest(&|t| (value(t) - truth(t)).abs()))
    }

    #[test]
    fn slow_motion_is_exact_and_fast_motion_does_not_alias() {
        for from in [(20, 1), (30, 1), (60, 1), (120, 1), (30_000, 1001)] {
            for hz in [0.5, 2.0, 4.0] {
                let (_, off) = measured(from, 15, hz);
                assert!(off < 3e-3, "{from:?} {hz} Hz: off by {off}");
            }
        }
        for (from, hz) in
            [((20, 1), 9.5), ((30, 1), 10.0), ((60, 1), 8.5), ((60, 1), 12.0), ((60, 1), 14.9), ((120, 1), 30.0)]
        {
            let (left, _) = measured(from, 15, hz);
            assert!(left < 3e-3, "{from:?} {hz} Hz: {left} is left");
        }
        let (_, off) = measured((10, 1), 15, 2.0);
        assert!(off < 3e-3, "upwards: {off}");
    }

    #[test]
    fn linear_motion_is_exact_up_to_its_ends_and_of_equal_duration() {
        for (from, n, to, expected) in
            [(60, 241, 15, 61), (30, 60, 15, 30), (20, 40, 15, 30), (15, 33, 15, 33), (30, 1, 15, 1)]
        {
            let fps = FrameRate::new(from, 1);
            let joints =
                Array3::from_shape_fn((n, N_JOINTS, 3), |(t, j, k)| (fps.secs(t) * j as f64 + k as f64) as f32);
            let moved = at_rate(&Motion::from_joints(fps, joints), FrameRate::new(to, 1));
            assert_eq!(moved.n_frames(), expected, "{from} to {to}");
            for ((t, j, k), &v) in moved.joints.indexed_iter() {
                let truth = moved.fps.secs(t) * j as f64 + k as f64;
                assert!((f64::from(v) - truth).abs() < 1e-6 * truth.max(1.0), "{from} to {to}, frame {t}: {v} {truth}");
            }
        }
    }

    #[test]
    fn a_gap_remains_a_gap_and_does_not_affect_other_frames() {
        let mut motion = swing(FrameRate::new(60, 1), 4.0, 1.0);
        motion.joints.slice_mut(ndarray::s![100..140, 2, ..]).fill(f32::NAN);
        motion.mask.slice_mut(ndarray::s![100..140, 2]).fill(false);
        motion.mask.slice_mut(ndarray::s![8..13, 3]).fill(false);
        let moved = at_rate(&motion, FrameRate::new(15, 1));
        for t in 0..moved.n_frames() {
            assert_eq!(moved.joints[[t, 2, 0]].is_nan(), (25..35).contains(&t), "frame {t}");
            assert_eq!(moved.mask[[t, 2]], !(25..35).contains(&t));
            assert_eq!(moved.mask[[t, 3]], !(2..4).contains(&t), "frame {t}");
            assert!(moved.joints[[t, 1, 0]].is_finite() && moved.mask[[t, 1]]);
        }
    }
}
