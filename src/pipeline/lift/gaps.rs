//! Gaps in a track: short ones are interpolated, long ones stay open. A track is [T, n, k]; a frame is missing as a
//! whole if its first value is NaN.

use ndarray::{ArrayViewMut3, Axis};

/// Whether each frame lies in a gap of `visible` of more than `longest` frames, gaps at the ends included.
pub fn long_gaps(visible: &[bool], longest: usize) -> Vec<bool> {
    let mut open = vec![false; visible.len()];
    let mut start = 0;
    for gap in visible.chunk_by(|a, b| a == b) {
        let end = start + gap.len();
        if !gap[0] && gap.len() > longest {
            open[start..end].fill(true);
        }
        start = end;
    }
    open
}

/// Linearly interpolates each gap of up to `longest` frames between two present frames.
pub fn bridge(mut track: ArrayViewMut3<f32>, longest: usize) {
    let mut last: Option<usize> = None;
    for t in 0..track.len_of(Axis(0)) {
        if track[[t, 0, 0]].is_nan() {
            continue;
        }
        if let Some(from) = last.filter(|from| t - from > 1 && t - from <= longest + 1) {
            for mut lane in track.lanes_mut(Axis(0)) {
                let (a, b) = (lane[from], lane[t]);
                (from + 1..t).for_each(|u| lane[u] = a + (b - a) * (u - from) as f32 / (t - from) as f32);
            }
        }
        last = Some(t);
    }
}

/// Extends the first and last present frame over gaps of up to `longest` frames at the ends.
pub fn hold_ends(mut track: ArrayViewMut3<f32>, longest: usize) {
    let n_frames = track.len_of(Axis(0));
    let is_present = |t: &usize| !track[[*t, 0, 0]].is_nan();
    let (Some(first), Some(last)) = ((0..n_frames).find(is_present), (0..n_frames).rev().find(is_present)) else {
        return;
    };
    for mut lane in track.lanes_mut(Axis(0)) {
        let (a, b) = (lane[first], lane[last]);
        if first <= longest {
            (0..first).for_each(|t| lane[t] = a);
        }
        if n_frames - 1 - last <= longest {
            (last + 1..n_frames).for_each(|t| lane[t] = b);
        }
    }
}
