//! Detection of hands resting on each other, the most common rest posture: one of them is mostly hidden, but no motion
//! is missed. Criterion: the wrists are close together and static; `table` accepts such hands even if they are not
//! visible.

use ndarray::ArrayView2;
use orator_base::math::order::lower_median;
use orator_base::types::pose2d::{Keypoints, VISIBLE_SCORE, coco};

/// Largest wrist distance, in shoulder widths, of hands that are together. Three resting people had 0.3 to 0.55.
const MAX_WRIST_DISTANCE: f32 = 0.6;
const HALF_WINDOW_SECS: f64 = 0.5;
/// Quantile of the distances that counts as movement, so that single outliers are ignored.
const QUANTILE: f64 = 0.8;
/// Value where the wrists are apart or not visible.
pub const NOT_RESTING: f32 = 10.0;

/// Distance of the wrists from their median position in the second around each frame (the larger of the two, 0.8
/// quantile), in shoulder widths, [T].
pub fn movement(keypoints: &Keypoints) -> Vec<f32> {
    let wrists: Vec<Option<[f32; 4]>> = keypoints.body.outer_iter().map(|body| wrists(&body)).collect();
    let half_window = (HALF_WINDOW_SECS * keypoints.fps.per_sec()).round() as usize;
    let around = |t: usize| &wrists[t.saturating_sub(half_window)..wrists.len().min(t + half_window + 1)];
    (0..wrists.len()).map(|t| spread(wrists[t], around(t)).unwrap_or(NOT_RESTING)).collect()
}

/// Left and right wrist relative to the neck (x, y, x, y), in shoulder widths; `None` if a point is not visible.
fn wrists(body: &ArrayView2<f32>) -> Option<[f32; 4]> {
    let points = [coco::L_SHOULDER, coco::R_SHOULDER, coco::L_WRIST, coco::R_WRIST];
    let [left, right, left_wrist, right_wrist] = points.map(|j| [body[[j, 0]], body[[j, 1]]]);
    let width = (left[0] - right[0]).hypot(left[1] - right[1]);
    let is_visible = width >= 1.0 && points.iter().all(|&j| body[[j, 2]] >= VISIBLE_SCORE);
    let about = |wrist: [f32; 2], k: usize| (wrist[k] - (left[k] + right[k]) / 2.0) / width;
    is_visible.then(|| [about(left_wrist, 0), about(left_wrist, 1), about(right_wrist, 0), about(right_wrist, 1)])
}

/// Movement over the frames `around` a frame with the wrists together; `None` if they are apart or mostly not visible.
fn spread(now: Option<[f32; 4]>, around: &[Option<[f32; 4]>]) -> Option<f32> {
    now.filter(|[lx, ly, rx, ry]| (lx - rx).hypot(ly - ry) <= MAX_WRIST_DISTANCE)?;
    let visible: Vec<[f32; 4]> = around.iter().copied().flatten().collect();
    let middle = [0, 1, 2, 3].map(|k| lower_median(visible.iter().map(|wrists| wrists[k])).unwrap_or(f32::NAN));
    let max_distance =
        |w: &[f32; 4]| (w[0] - middle[0]).hypot(w[1] - middle[1]).max((w[2] - middle[2]).hypot(w[3] - middle[3]));
    let mut distances: Vec<f32> = visible.iter().map(max_distance).collect();
    distances.sort_by(f32::total_cmp);
    let at = (QUANTILE * distances.len().saturating_sub(1) as f64).ceil() as usize;
    distances.get(at).copied().filter(|_| 2 * visible.len() > around.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_keypoints::bodies;
    use ndarray::s;

    /// Shoulders 100 px apart; wrists `apart` px, the left one shifted by `dx(t)`.
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
    fn static_wrists_close_together_are_resting() {
        let static_wrists = movement(&seated(40.0, |t| if t == 20 { 90.0 } else { (t % 2) as f32 }));
        assert!(
            static_wrists.iter().enumerate().all(|(t, &m)| if t == 20 { m == NOT_RESTING } else { m < 0.02 }),
            "{static_wrists:?}"
        );
        let stroke =
            movement(&seated(40.0, |t| if (20..40).contains(&t) { (20 - t.abs_diff(30)) as f32 } else { 0.0 }));
        assert!(stroke[5] == 0.0 && stroke[24] > 0.05, "{stroke:?}");
        assert!(movement(&seated(70.0, |_| 0.0)).iter().all(|&m| m == NOT_RESTING), "apart");
        let mut hidden = seated(40.0, |_| 0.0);
        hidden.body.slice_mut(s![.., coco::L_WRIST, 2]).fill(0.1);
        assert!(movement(&hidden).iter().all(|&m| m == NOT_RESTING));
    }
}
