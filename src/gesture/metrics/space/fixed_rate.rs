//! Input of the two fixed spaces (`basis`, `embedding`): motion resampled to 15 fps, joints relative to the neck, and
//! the ranges of frames in which nothing is missing.

use ndarray::{Array3, ArrayView2, ArrayView3};
use orator_base::math::runs::true_ranges;
use orator_base::types::skeleton::{N_JOINTS, NECK, is_duplicate};
use orator_base::types::time::FrameRate;
use std::ops::Range;

pub const FPS: FrameRate = FrameRate::new(15, 1);
/// Number of joints used: all but the neck and the two hand roots.
pub const N_JOINTS_USED: usize = 46;
pub const N_COORDINATES: usize = 3 * N_JOINTS_USED;

/// The joints used, in skeleton order.
pub fn joints_used() -> impl Iterator<Item = usize> {
    (NECK + 1..N_JOINTS).filter(|joint| !is_duplicate(*joint))
}

/// Motion at 15 fps.
pub struct Frames {
    /// Joints [T, 49, 3], metres, the neck at the origin.
    pub joints: Array3<f32>,
    /// Ranges of frames in which all joints used are visible, and they and the neck are finite.
    pub complete: Vec<Range<usize>>,
}

impl Frames {
    /// Resamples `joints` [T, 49, 3] with `mask` [T, 49] to 15 fps. Frames are interpolated linearly between their two
    /// neighbours, and complete if both are.
    pub fn new(joints: ArrayView3<f32>, mask: ArrayView2<bool>, fps: FrameRate) -> Self {
        let n = joints.shape()[0].min(mask.nrows());
        let is_complete = |t: usize| {
            let there = |joint: usize| (0..3).all(|k| joints[[t, joint, k]].is_finite());
            there(NECK) && joints_used().all(|joint| mask[[t, joint]] && there(joint))
        };
        let source: Vec<bool> = (0..n).map(is_complete).collect();
        let per_frame = fps.per_sec() / FPS.per_sec();
        let n_out = if n == 0 { 0 } else { ((n - 1) as f64 / per_frame + 1e-9) as usize + 1 };
        let neighbour = |t: usize| {
            let at = t as f64 * per_frame;
            // Positions this close to a frame are that frame.
            let (before, along) = (at as usize, at.fract());
            match along {
                _ if along < 1e-6 || before + 1 >= n => (before.min(n - 1), 0.0),
                _ if along > 1.0 - 1e-6 => (before + 1, 0.0),
                _ => (before, along as f32),
            }
        };
        let mut out = Array3::zeros((n_out, N_JOINTS, 3));
        let mut visible = vec![false; n_out];
        for (t, (mut frame, visible)) in out.outer_iter_mut().zip(&mut visible).enumerate() {
            let (a, along) = neighbour(t);
            let b = if along > 0.0 { a + 1 } else { a };
            *visible = source[a] && source[b];
            let at = |joint: usize, k: usize| {
                let (from, to) = (joints[[a, joint, k]], joints[[b, joint, k]]);
                from + along * (to - from)
            };
            for joint in 0..N_JOINTS {
                (0..3).for_each(|k| frame[[joint, k]] = at(joint, k) - at(NECK, k));
            }
        }
        Self { joints: out, complete: true_ranges(&visible).collect() }
    }

    /// First frames of the windows of `window` frames, every `stride` frames within each complete range.
    pub fn starts(&self, window: usize, stride: usize) -> Vec<usize> {
        let of = |range: &Range<usize>| (range.start..(range.end + 1).saturating_sub(window)).step_by(stride);
        self.complete.iter().flat_map(of).collect()
    }
}
