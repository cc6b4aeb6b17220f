//! Observed upper body over an interval: nine points from COCO keypoints, outliers removed, short gaps interpolated.

use super::gaps;
use ndarray::{Array2, Array3, s};
use orator_base::math::order::{lower_median, median};
use orator_base::motion::upper_body::{
    BodyPoints, COCO, L_HIP, L_SHOULDER, L_WRIST, N_POINTS, NOSE, R_HIP, R_SHOULDER, R_WRIST,
};
use orator_base::types::interval::Interval;
use orator_base::types::pose2d::{Keypoints, VISIBLE_SCORE, coco};
use orator_base::types::skeleton::BODY_BONES;

/// Largest valid coordinate, px.
pub const MAX_PX: f32 = 1e6;
/// Position of the nose on the line from the eyes to the neck; an estimate disturbs lifting less than a missing one.
const NOSE_POSITION: f32 = 0.15;
/// Outlier: a point whose distance from the median of neighbouring frames exceeds this share of the largest bone...
const MIN_OUTLIER_SHARE: f32 = 0.15;
/// ...plus this many times the largest such distance among the neighbours: in a fast gesture they move as well. Beats
/// of up to 3.5 Hz pass unchanged.
const MIN_OUTLIER_SPREAD: f32 = 2.0;

/// The nine points over an interval.
pub struct ObservedBody {
    /// Positions in px, [T, 9, 2]; NaN: not visible and not in a short gap.
    points: Array3<f32>,
    /// Whether the keypoints contain the point, [T, 9].
    pub visible: Array2<bool>,
}

impl ObservedBody {
    /// Reads the points of an interval. A point that jumps away and back within `half_window` frames on either side
    /// counts as not visible; gaps of up to `max_gap` frames are interpolated.
    pub fn from_keypoints(keypoints: &Keypoints, interval: Interval, half_window: usize, max_gap: usize) -> Self {
        let mut points = Array3::from_elem((interval.n_frames(), N_POINTS, 2), f32::NAN);
        for (t, mut frame) in points.outer_iter_mut().enumerate() {
            for (j, point) in frame_points(keypoints, interval.start + t).into_iter().enumerate() {
                if let Some([x, y]) = point {
                    (frame[[j, 0]], frame[[j, 1]]) = (x, y);
                }
            }
        }
        remove_outliers(&mut points, half_window);
        let visible = points.slice(s![.., .., 0]).mapv(|x| !x.is_nan());
        for j in 0..N_POINTS {
            gaps::bridge(points.slice_mut(s![.., j..j + 1, ..]), max_gap);
        }
        Self { points, visible }
    }

    /// Hides and interpolates points not `is_inlier` [T, 9] for up to `max_gap` frames. Returns whether any are.
    pub fn reject(&mut self, is_inlier: &Array2<bool>, max_gap: usize) -> bool {
        let mut any_rejected = false;
        for j in 0..N_POINTS {
            let long = gaps::long_gaps(&is_inlier.column(j).to_vec(), max_gap);
            for t in (0..long.len()).filter(|&t| !is_inlier[[t, j]] && !long[t]) {
                self.points.slice_mut(s![t, j, ..]).fill(f32::NAN);
                self.visible[[t, j]] = false;
                any_rejected = true;
            }
            gaps::bridge(self.points.slice_mut(s![.., j..j + 1, ..]), max_gap);
        }
        any_rejected
    }

    /// One frame as input of the body lifter.
    pub fn frame(&self, t: usize) -> BodyPoints {
        std::array::from_fn(|j| at(&self.points, t, j))
    }
}

/// Points of a frame. A missing wrist is taken from the hand model, a missing nose from the eyes or else the ears.
fn frame_points(keypoints: &Keypoints, t: usize) -> BodyPoints {
    let point = |array: &Array3<f32>, j: usize| {
        let [x, y, score] = [0, 1, 2].map(|k| array[[t, j, k]]);
        (score >= VISIBLE_SCORE && x.abs() <= MAX_PX && y.abs() <= MAX_PX).then_some([x, y])
    };
    let body = |j: usize| point(&keypoints.body, j);
    let mut frame_points = COCO.map(body);
    // Detectors place hips that are outside the picture somewhere below it.
    let [width, height] = keypoints.image_size.map(|px| px as f32);
    for hip in [R_HIP, L_HIP] {
        frame_points[hip] = frame_points[hip].filter(|[x, y]| (0.0..=width).contains(x) && (0.0..=height).contains(y));
    }
    frame_points[R_WRIST] = frame_points[R_WRIST].or_else(|| point(&keypoints.right_hand, 0));
    frame_points[L_WRIST] = frame_points[L_WRIST].or_else(|| point(&keypoints.left_hand, 0));
    let nose_from_eyes = || {
        let eyes = middle(body(coco::R_EYE), body(coco::L_EYE))?;
        let neck =
            middle(frame_points[R_SHOULDER].filter(|_| frame_points[L_SHOULDER].is_some()), frame_points[L_SHOULDER])?;
        Some([0, 1].map(|k| eyes[k] + NOSE_POSITION * (neck[k] - eyes[k])))
    };
    frame_points[NOSE] =
        frame_points[NOSE].or_else(nose_from_eyes).or_else(|| middle(body(coco::R_EAR), body(coco::L_EAR)));
    frame_points
}

/// Midpoint of two points, or the one that is present.
fn middle(a: Option<[f32; 2]>, b: Option<[f32; 2]>) -> Option<[f32; 2]> {
    match (a, b) {
        (Some(a), Some(b)) => Some([0, 1].map(|k| (a[k] + b[k]) / 2.0)),
        (one, other) => one.or(other),
    }
}

/// Removes the points that are far from the median of the neighbouring frames, relative to the spread of those.
fn remove_outliers(points: &mut Array3<f32>, half_window: usize) {
    let n_frames = points.shape()[0];
    let largest: Vec<f32> = (0..n_frames).map(|t| largest_bone(points, t)).collect();
    let mut outliers = Vec::new();
    let mut around = Vec::with_capacity(2 * half_window);
    for t in 0..n_frames {
        let frames = t.saturating_sub(half_window)..n_frames.min(t + half_window + 1);
        let Some(largest) = lower_median(largest[frames.clone()].iter().copied()) else { continue };
        for j in 0..N_POINTS {
            let Some(own) = at(points, t, j) else { continue };
            around.clear();
            around.extend((frames.start..t).filter_map(|u| at(points, u, j)));
            let n_before = around.len();
            around.extend((t + 1..frames.end).filter_map(|u| at(points, u, j)));
            if n_before == 0 || around.len() == n_before {
                continue;
            }
            // For an even number, the mean of the two middle values, so that the result does not depend on direction.
            let median_position = [0, 1].map(|k| median(around.iter().map(|p| p[k])).unwrap_or(f32::NAN));
            let distance = |p: &[f32; 2]| (p[0] - median_position[0]).hypot(p[1] - median_position[1]);
            if distance(&own)
                > MIN_OUTLIER_SHARE * largest + MIN_OUTLIER_SPREAD * around.iter().map(distance).fold(0.0, f32::max)
            {
                outliers.push((t, j));
            }
        }
    }
    for (t, j) in outliers {
        points.slice_mut(s![t, j, ..]).fill(f32::NAN);
    }
}

fn at(points: &Array3<f32>, t: usize, j: usize) -> Option<[f32; 2]> {
    let point = [points[[t, j, 0]], points[[t, j, 1]]];
    (!point[0].is_nan()).then_some(point)
}

/// Length of the largest visible bone in a frame, px; NaN if there is none.
fn largest_bone(points: &Array3<f32>, t: usize) -> f32 {
    let bone = |&(a, b): &(usize, usize)| {
        let (a, b) = (at(points, t, a)?, at(points, t, b)?);
        Some((a[0] - b[0]).hypot(a[1] - b[1]))
    };
    BODY_BONES.iter().filter_map(bone).fold(f32::NAN, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_keypoints::bodies;
    use orator_base::motion::upper_body::R_ELBOW;

    /// A speaker whose right wrist swings 120 px wide at `hertz`, at 15 fps.
    fn beating(n_frames: usize, hertz: f32) -> Keypoints {
        bodies(n_frames, [1280, 720], |t| {
            let swing = 60.0 * (std::f32::consts::TAU * hertz * t as f32 / 15.0).sin();
            [
                (coco::NOSE, 640.0, 180.0),
                (coco::R_SHOULDER, 560.0, 260.0),
                (coco::R_ELBOW, 540.0, 380.0),
                (coco::R_WRIST, 600.0 + swing, 440.0),
                (coco::L_SHOULDER, 720.0, 260.0),
                (coco::L_ELBOW, 750.0, 380.0),
                (coco::L_WRIST, 700.0, 440.0),
                (coco::L_EYE, 660.0, 160.0),
                (coco::R_EYE, 620.0, 160.0),
            ]
        })
    }

    fn observe(keypoints: &Keypoints) -> ObservedBody {
        ObservedBody::from_keypoints(keypoints, Interval { start: 0, end: keypoints.n_frames() }, 2, 15)
    }

    #[test]
    fn outliers_are_removed_and_fast_gestures_retained() {
        for hertz in [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5] {
            let keypoints = beating(60, hertz);
            assert!(
                observe(&keypoints).visible.slice(s![.., ..7]).iter().all(|visible| *visible),
                "{hertz} beats a second"
            );
        }
        let mut keypoints = beating(60, 0.5);
        keypoints.body[[20, coco::R_WRIST, 0]] += 200.0;
        keypoints.body[[21, coco::L_SHOULDER, 1]] -= 90.0;
        keypoints.body.slice_mut(s![40.., .., 0]).mapv_inplace(|x| x + 300.0); // the picture jumps: no stray
        let observed = observe(&keypoints);
        let removed: Vec<(usize, usize)> = observed
            .visible
            .slice(s![.., ..7])
            .indexed_iter()
            .filter(|(_, visible)| !**visible)
            .map(|(at, _)| at)
            .collect();
        assert_eq!(removed, [(20, R_WRIST), (21, L_SHOULDER)]);
        let [x, y] = observed.frame(21)[L_SHOULDER].unwrap();
        assert!((x - 720.0).abs() < 1e-3 && (y - 260.0).abs() < 1e-3, "bridged from the frames beside");
    }

    #[test]
    fn the_result_is_symmetric_in_time() {
        let mut forth = beating(50, 1.3);
        forth.body[[20, coco::R_WRIST, 1]] += 150.0;
        forth.body.slice_mut(s![30..35, coco::L_ELBOW, ..]).fill(0.0);
        let mut back = forth.clone();
        back.body.invert_axis(ndarray::Axis(0));
        let (forth, back) = (observe(&forth), observe(&back));
        for t in 0..50 {
            assert_eq!(forth.visible.row(t), back.visible.row(49 - t));
            for (a, b) in forth.frame(t).iter().flatten().zip(back.frame(49 - t).iter().flatten()) {
                assert!((a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn missing_points_are_substituted() {
        let mut keypoints = beating(30, 1.0);
        keypoints.body.slice_mut(s![.., coco::NOSE, ..]).fill(0.0);
        keypoints.body.slice_mut(s![.., coco::L_WRIST, ..]).fill(0.0);
        keypoints.left_hand.slice_mut(s![.., 0, ..]).assign(&ndarray::arr1(&[690.0, 450.0, 0.9]));
        keypoints.body.slice_mut(s![5..25, coco::R_ELBOW, 2]).fill(0.0);
        keypoints.body[[3, coco::R_WRIST, 0]] = 1e20;
        let observed = observe(&keypoints);
        assert_eq!(observed.frame(7)[NOSE], Some([640.0, 175.0]));
        assert_eq!(observed.frame(7)[L_WRIST], Some([690.0, 450.0]));
        assert!(observed.frame(7)[R_ELBOW].is_none() && observed.frame(3)[R_ELBOW].is_some(), "a long gap stays open");
        assert!(!observed.visible[[3, R_WRIST]] && observed.frame(3)[R_WRIST].is_some());
    }
}
