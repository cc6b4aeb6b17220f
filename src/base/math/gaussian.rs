//! Smoothing over time without delay: a Gaussian-weighted straight line is fitted around every frame and evaluated at
//! that frame. In the middle of a track this equals the Gaussian filter; at the ends and beside gaps it reproduces
//! linear motion, where a truncated kernel would be biased.

use ndarray::{ArrayViewMut1, ArrayViewMut3, Axis};

/// Smooths every value of `tracks` [T, n, k] along T with a Gaussian of `sigma` frames; `sigma` 0 changes nothing.
/// Non-finite values are unchanged and end a track: nothing is smoothed across a gap.
pub fn gaussian(mut tracks: ArrayViewMut3<f32>, sigma: f64) {
    let half = (3.0 * sigma).ceil();
    if !(1.0..10_000.0).contains(&half) {
        return;
    }
    let weights: Vec<f64> = (0..=half as usize).map(|d| (-0.5 * (d as f64 / sigma).powi(2)).exp()).collect();
    for track in tracks.lanes_mut(Axis(0)) {
        smooth_track(track, &weights);
    }
}

/// `weights[d]` is the weight at a distance of d frames.
fn smooth_track(mut track: ArrayViewMut1<f32>, weights: &[f64]) {
    let raw = track.to_vec();
    let half = weights.len() - 1;
    let mut run_start = 0;
    while run_start < raw.len() {
        let run = raw[run_start..].iter().take_while(|v| v.is_finite()).count();
        let run_end = run_start + run;
        for t in run_start..run_end {
            let (mut s0, mut s1, mut s2, mut v0, mut v1) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for (u, &value) in
                raw.iter().enumerate().take(run_end.min(t + half + 1)).skip(run_start.max(t.saturating_sub(half)))
            {
                let d = u as f64 - t as f64;
                let (w, v) = (weights[u.abs_diff(t)], f64::from(value));
                s0 += w;
                s1 += w * d;
                s2 += w * d * d;
                v0 += w * v;
                v1 += w * d * v;
            }
            let det = s0 * s2 - s1 * s1;
            track[t] = (if det > 1e-9 { (s2 * v0 - s1 * v1) / det } else { v0 / s0 }) as f32;
        }
        run_start = run_end + 1;
    }
}
