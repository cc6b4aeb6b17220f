//! Depth ambiguity of hands. A 2D projection of a hand fits two hands that are mirror images in depth, and the hand
//! lifter, which processes single frames, sometimes chooses the wrong one. The sequence of choices that is smoothest
//! over time and agrees best with the depth of the hand model is found as a shortest path (Viterbi 1967).

use ndarray::{ArrayView2, ArrayView3, ArrayViewMut3, s};

/// Cost per second of mirroring the lifter's output, in hand sizes (sum of the bone lengths) of mean joint movement.
/// On real clips, values from slightly less to twice this bring hands closer to the output of another hand model.
const MIRROR_COST_PER_SEC: f32 = 15.0 * 0.005;

/// Cost per second of a depth opposite to that of the hand model, in the same unit.
const OPPOSITE_COST_PER_SEC: f32 = 15.0 * 0.02;

/// Mirrors the hands of `track` [T, 21, 3] in depth (z to -z, wrist at 0) where that makes the motion smoother or
/// nearer to `model_depth` [T, 21], if there is one. `frame_secs` is a frame's time. Missing hands (NaN) are skipped.
pub fn resolve(mut track: ArrayViewMut3<f32>, model_depth: Option<ArrayView2<f32>>, frame_secs: f32) {
    let frames: Vec<u32> =
        (0..track.len_of(ndarray::Axis(0)) as u32).filter(|t| is_present(&track.view(), *t)).collect();
    // Cost of the best path that ends unmirrored and mirrored; `mirrored_before` holds the state each came from.
    let costs_of_frame = |track: &ArrayView3<f32>, t: u32| {
        let agreement = model_depth.map_or(0.0, |depth| agreement(track, &depth, t as usize));
        [-1.0, 1.0].map(|sign| 0.5 * (1.0 + sign * agreement) * OPPOSITE_COST_PER_SEC * frame_secs)
    };
    let mut costs = frames.first().map_or([0.0; 2], |&first| costs_of_frame(&track.view(), first));
    costs[1] += MIRROR_COST_PER_SEC * frame_secs;
    let mut mirrored_before = Vec::with_capacity(frames.len());
    for pair in frames.windows(2) {
        let (direct, to_mirrored) = movement(&track.view(), pair[0] as usize, pair[1] as usize);
        let of_frame = costs_of_frame(&track.view(), pair[1]);
        let apart = (pair[1] - pair[0]) as f32 * frame_secs * 15.0;
        let step = |to: usize| {
            let from = |from: usize| costs[from] + if from == to { direct } else { to_mirrored } / apart;
            let best = usize::from(from(1) < from(0));
            (best, from(best) + of_frame[to] + to as f32 * MIRROR_COST_PER_SEC * frame_secs)
        };
        let (own, mirrored) = (step(0), step(1));
        costs = [own.1, mirrored.1];
        mirrored_before.push([own.0 == 1, mirrored.0 == 1]);
    }
    let mut mirrored = costs[1] < costs[0];
    for (i, &t) in frames.iter().enumerate().rev() {
        if mirrored {
            track.slice_mut(s![t as usize, .., 2]).mapv_inplace(|z| -z);
        }
        if i > 0 {
            mirrored = mirrored_before[i - 1][usize::from(mirrored)];
        }
    }
}

fn is_present(track: &ArrayView3<f32>, t: u32) -> bool {
    !track[[t as usize, 0, 0]].is_nan()
}

/// Correlation -1..1 of the depths of a hand and of the hand model, about the wrist; 0 if one has no depth.
fn agreement(track: &ArrayView3<f32>, model_depth: &ArrayView2<f32>, t: usize) -> f32 {
    let (mut product, mut own, mut other) = (0.0, 0.0, 0.0);
    for j in 0..track.shape()[1] {
        let (a, b) = (track[[t, j, 2]], model_depth[[t, j]]);
        (product, own, other) = (product + a * b, own + a * a, other + b * b);
    }
    let scale = (own * other).sqrt();
    if scale > 1e-9 && scale.is_finite() { product / scale } else { 0.0 }
}

/// Mean movement of the joints from frame `a` to frame `b`, and to the mirror image of `b`.
fn movement(track: &ArrayView3<f32>, a: usize, b: usize) -> (f32, f32) {
    let n = track.shape()[1];
    let (mut direct, mut to_mirrored) = (0.0, 0.0);
    for j in 0..n {
        let flat = (0..2).map(|k| (track[[a, j, k]] - track[[b, j, k]]).powi(2)).sum::<f32>();
        direct += (flat + (track[[a, j, 2]] - track[[b, j, 2]]).powi(2)).sqrt();
        to_mirrored += (flat + (track[[a, j, 2]] + track[[b, j, 2]]).powi(2)).sqrt();
    }
    (direct / n as f32, to_mirrored / n as f32)
}
