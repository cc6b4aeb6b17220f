//! The side a hand is seen from. A flat picture of a hand fits two hands, one the mirror image of the other in depth, and
//! the hand lifter, which looks at single frames, now and then answers with the wrong one. Over time the answers that
//! follow each other most smoothly are chosen: the shortest path through both (Viterbi 1967).

use ndarray::{ArrayView3, ArrayViewMut3, s};

/// What it costs for a second to believe the mirror image of the lifter's answer, in lengths of the hand (all its
/// bones) that its joints move on average. On real clips anything from a little less to twice as much brought hands
/// nearer to what another hand model sees.
const DISTRUST: f32 = 15.0 * 0.005;

/// Mirrors the hands of `track` [T, 21, 3] in depth (z to -z, the wrist at 0) where that makes the motion smoother;
/// `frame_secs`: the time between two frames. Missing hands (NaN) are passed over.
pub fn settle(mut track: ArrayViewMut3<f32>, frame_secs: f32) {
    let frames: Vec<u32> = (0..track.len_of(ndarray::Axis(0)) as u32).filter(|t| is_there(&track.view(), *t)).collect();
    // cost of the best path that ends as lifted, or mirrored; and from which of the two it came
    let mut costs = [0.0, DISTRUST * frame_secs];
    let mut came = Vec::with_capacity(frames.len());
    for pair in frames.windows(2) {
        let (along, across) = moves(&track.view(), pair[0] as usize, pair[1] as usize);
        let apart = (pair[1] - pair[0]) as f32 * frame_secs * 15.0;
        let step = |to: usize| {
            let from = |from: usize| costs[from] + if from == to { along } else { across } / apart;
            let best = usize::from(from(1) < from(0));
            (best, from(best) + to as f32 * DISTRUST * frame_secs)
        };
        let (own, mirrored) = (step(0), step(1));
        costs = [own.1, mirrored.1];
        came.push([own.0 == 1, mirrored.0 == 1]);
    }
    let mut mirrored = costs[1] < costs[0];
    for (i, &t) in frames.iter().enumerate().rev() {
        if mirrored {
            track.slice_mut(s![t as usize, .., 2]).mapv_inplace(|z| -z);
        }
        if i > 0 {
            mirrored = came[i - 1][usize::from(mirrored)];
        }
    }
}

fn is_there(track: &ArrayView3<f32>, t: u32) -> bool {
    !track[[t as usize, 0, 0]].is_nan()
}

/// How far the joints move on average from frame `a` to frame `b`, and to the mirror image of `b`.
fn moves(track: &ArrayView3<f32>, a: usize, b: usize) -> (f32, f32) {
    let n = track.shape()[1];
    let (mut along, mut across) = (0.0, 0.0);
    for j in 0..n {
        let flat = (0..2).map(|k| (track[[a, j, k]] - track[[b, j, k]]).powi(2)).sum::<f32>();
        along += (flat + (track[[a, j, 2]] - track[[b, j, 2]]).powi(2)).sqrt();
        across += (flat + (track[[a, j, 2]] + track[[b, j, 2]]).powi(2)).sqrt();
    }
    (along / n as f32, across / n as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array3;

    /// A hand that turns slowly: its points lie up to 0.2 deep.
    fn turning(n_frames: usize) -> Array3<f32> {
        Array3::from_shape_fn((n_frames, 21, 3), |(t, j, k)| {
            let angle = 0.3 + 0.01 * t as f32;
            0.01 * j as f32 * [0.4, -angle.cos(), -angle.sin()][k]
        })
    }

    fn settled(mut track: Array3<f32>) -> Array3<f32> {
        settle(track.view_mut(), 1.0 / 15.0);
        track
    }

    #[test]
    fn hands_seen_from_the_wrong_side_are_turned_back() {
        let truth = turning(60);
        assert_eq!(settled(truth.clone()), truth);
        let mut wrong = truth.clone();
        for t in [0, 7, 20, 21, 22, 23, 40, 59] {
            wrong.slice_mut(s![t, .., 2]).mapv_inplace(|z| -z);
        }
        wrong.slice_mut(s![30..33, .., ..]).fill(f32::NAN);
        let mut expected = truth;
        expected.slice_mut(s![30..33, .., ..]).fill(f32::NAN);
        assert!(settled(wrong).iter().zip(&expected).all(|(a, b)| a == b || a.is_nan() && b.is_nan()));
    }

    #[test]
    fn the_lifter_is_believed_over_the_most_of_the_time() {
        let mut wrong = turning(60);
        wrong.slice_mut(s![..50, .., 2]).mapv_inplace(|z| -z);
        let settled = settled(wrong.clone());
        assert_eq!(settled.slice(s![..50, .., ..]), wrong.slice(s![..50, .., ..]));
        assert_eq!(settled[[55, 20, 2]], -wrong[[55, 20, 2]]);
        settle(Array3::zeros((0, 21, 3)).view_mut(), 0.1);
    }
}
