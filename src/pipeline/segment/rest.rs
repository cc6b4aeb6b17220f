//! Hands that rest on each other, the commonest rest: one of them is mostly hidden, and yet nothing of the motion is
//! missing. They are told by the wrists, which lie together and keep still; `table` lets such hands be unseen.

use ndarray::ArrayView2;
use orator_base::math::order::lower_median;
use orator_base::types::pose2d::{Keypoints, SEEN_SCORE, coco};

/// Wrists that are nearer than this, in shoulder widths, lie together. Of three real people at rest they are 0.3 to 0.55
/// apart.
const TOGETHER: f32 = 0.6;
/// Half the time over which the movement is measured, seconds.
const REACH_SECS: f64 = 0.5;
/// Share of the frames whose movement counts: a single stray point does not.
const MOST_FRAMES: f64 = 0.8;
/// Movement where the wrists do not lie together or are not seen.
pub const APART: f32 = 10.0;

/// How far the farther wrist is from where it mostly is, in the second around each frame, in shoulder widths, [T].
pub fn movement(keypoints: &Keypoints) -> Vec<f32> {
    let wrists: Vec<Option<[f32; 4]>> = keypoints.body.outer_iter().map(|body| wrists(&body)).collect();
    let reach = (REACH_SECS * keypoints.fps.per_sec()).round() as usize;
    let around = |t: usize| &wrists[t.saturating_sub(reach)..wrists.len().min(t + reach + 1)];
    (0..wrists.len()).map(|t| spread(wrists[t], around(t)).unwrap_or(APART)).collect()
}

/// Left and right wrist about the neck (x, y, x, y), in shoulder widths; `None` where one of these points is not seen.
fn wrists(body: &ArrayView2<f32>) -> Option<[f32; 4]> {
    let points = [coco::L_SHOULDER, coco::R_SHOULDER, coco::L_WRIST, coco::R_WRIST];
    let [left, right, left_wrist, right_wrist] = points.map(|j| [body[[j, 0]], body[[j, 1]]]);
    let width = (left[0] - right[0]).hypot(left[1] - right[1]);
    let is_seen = width >= 1.0 && points.iter().all(|&j| body[[j, 2]] >= SEEN_SCORE);
    let about = |wrist: [f32; 2], k: usize| (wrist[k] - (left[k] + right[k]) / 2.0) / width;
    is_seen.then(|| [about(left_wrist, 0), about(left_wrist, 1), about(right_wrist, 0), about(right_wrist, 1)])
}

/// Movement of the frames `around` one whose wrists lie together; `None` where they do not, or are mostly not seen.
fn spread(now: Option<[f32; 4]>, around: &[Option<[f32; 4]>]) -> Option<f32> {
    now.filter(|[lx, ly, rx, ry]| (lx - rx).hypot(ly - ry) <= TOGETHER)?;
    let seen: Vec<[f32; 4]> = around.iter().copied().flatten().collect();
    let middle = [0, 1, 2, 3].map(|k| lower_median(seen.iter().map(|wrists| wrists[k])).unwrap_or(f32::NAN));
    let away =
        |w: &[f32; 4]| (w[0] - middle[0]).hypot(w[1] - middle[1]).max((w[2] - middle[2]).hypot(w[3] - middle[3]));
    let mut farthest: Vec<f32> = seen.iter().map(away).collect();
    farthest.sort_by(f32::total_cmp);
    let at = (MOST_FRAMES * farthest.len().saturating_sub(1) as f64).ceil() as usize;
    farthest.get(at).copied().filter(|_| 2 * seen.len() > around.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_keypoints::bodies;
    use ndarray::s;

    /// Shoulders 100 px apart; wrists `apart` px, the left one moved by `dx(t)`.
    fn seated(apart: f32, dx: impl Fn(usize) -> f32) -> Keypoints {
        bodies(60, [400, 400], |t| {
            [
                (coco::L_SHOULDER, 200.0, 100.0),
                (coco::R_SHOULDER, 100.0, 100.0),
                (coco::L_WRIST, 150.0 + apart / 2.0 + dx(t), 220.0),
                (coco::R_WRIST, 150.0 - apart / 2.0, 220.0),
            ]
        })
    }

    #[test]
    fn still_wrists_that_lie_together_rest() {
        let still = movement(&seated(40.0, |t| if t == 20 { 90.0 } else { (t % 2) as f32 }));
        assert!(still.iter().enumerate().all(|(t, &m)| if t == 20 { m == APART } else { m < 0.02 }), "{still:?}");
        let stroke =
            movement(&seated(40.0, |t| if (20..40).contains(&t) { (20 - t.abs_diff(30)) as f32 } else { 0.0 }));
        assert!(stroke[5] == 0.0 && stroke[24] > 0.05, "{stroke:?}");
        assert!(movement(&seated(70.0, |_| 0.0)).iter().all(|&m| m == APART), "apart");
        let mut unseen = seated(40.0, |_| 0.0);
        unseen.body.slice_mut(s![.., coco::L_WRIST, 2]).fill(0.1);
        assert!(movement(&unseen).iter().all(|&m| m == APART));
    }
}
