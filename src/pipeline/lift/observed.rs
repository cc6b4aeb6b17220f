//! What is seen of the upper body over an interval: the nine points from COCO keypoints, single strays taken out, short
//! gaps bridged.

use super::gaps;
use ndarray::{Array2, Array3, s};
use orator_base::math::order::{lower_median, median};
use orator_base::motion::upper_body::{
    COCO, L_HIP, L_SHOULDER, L_WRIST, N_POINTS, NOSE, R_HIP, R_SHOULDER, R_WRIST, SeenBody,
};
use orator_base::types::interval::Interval;
use orator_base::types::pose2d::{Keypoints, SEEN_SCORE, coco};
use orator_base::types::skeleton::BODY_BONES;

/// A coordinate beyond this many px is none.
pub const FARTHEST_PX: f32 = 1e6;
/// The nose lies this share of the way from the eyes to the neck; a guess that moves lifted joints less than no nose.
const NOSE_BELOW_EYES: f32 = 0.15;
/// A point is a stray when it lies this share of the body's largest bone away from where it is in the frames around...
const STRAY: f32 = 0.15;
/// ...and this many times as far as the farthest of those: a fast gesture moves in them as well. Beats of up to 3.5 a
/// second pass untouched.
const STRAY_SPREAD: f32 = 2.0;

/// The nine points over an interval.
pub struct ObservedBody {
    /// px, [T, 9, 2]; NaN: not seen, and no short gap.
    points: Array3<f32>,
    /// [T, 9]; whether the keypoints show the point.
    pub seen: Array2<bool>,
}

impl ObservedBody {
    /// What the keypoints show. A point that jumps away and back within `reach` frames before and after is not seen; a
    /// gap of up to `max_gap` frames between two frames is bridged.
    pub fn from_keypoints(keypoints: &Keypoints, interval: Interval, reach: usize, max_gap: usize) -> Self {
        let mut points = Array3::from_elem((interval.n_frames(), N_POINTS, 2), f32::NAN);
        for (t, mut frame) in points.outer_iter_mut().enumerate() {
            for (j, point) in shown(keypoints, interval.start + t).into_iter().enumerate() {
                if let Some([x, y]) = point {
                    (frame[[j, 0]], frame[[j, 1]]) = (x, y);
                }
            }
        }
        remove_strays(&mut points, reach);
        let seen = points.slice(s![.., .., 0]).mapv(|x| !x.is_nan());
        for j in 0..N_POINTS {
            gaps::bridge(points.slice_mut(s![.., j..j + 1, ..]), max_gap);
        }
        Self { points, seen }
    }

    /// Makes unseen, and bridges, the points that are not `believed` [T, 9] for up to `max_gap` frames in a row; whether there
    /// are any.
    pub fn forget(&mut self, believed: &Array2<bool>, max_gap: usize) -> bool {
        let mut forgotten = false;
        for j in 0..N_POINTS {
            let long = gaps::long_gaps(&believed.column(j).to_vec(), max_gap);
            for t in (0..long.len()).filter(|&t| !believed[[t, j]] && !long[t]) {
                self.points.slice_mut(s![t, j, ..]).fill(f32::NAN);
                self.seen[[t, j]] = false;
                forgotten = true;
            }
            gaps::bridge(self.points.slice_mut(s![.., j..j + 1, ..]), max_gap);
        }
        forgotten
    }

    /// A frame as the body lifter takes it.
    pub fn frame(&self, t: usize) -> SeenBody {
        std::array::from_fn(|j| at(&self.points, t, j))
    }
}

/// The points of a frame. A wrist that the body model misses is taken from the hand model, a nose from the eyes or,
/// further, the ears.
fn shown(keypoints: &Keypoints, t: usize) -> SeenBody {
    let point = |array: &Array3<f32>, j: usize| {
        let [x, y, score] = [0, 1, 2].map(|k| array[[t, j, k]]);
        (score >= SEEN_SCORE && x.abs() <= FARTHEST_PX && y.abs() <= FARTHEST_PX).then_some([x, y])
    };
    let body = |j: usize| point(&keypoints.body, j);
    let mut shown = COCO.map(body);
    // detectors put hips that the picture does not show somewhere below it
    let [width, height] = keypoints.image_size.map(|px| px as f32);
    for hip in [R_HIP, L_HIP] {
        shown[hip] = shown[hip].filter(|[x, y]| (0.0..=width).contains(x) && (0.0..=height).contains(y));
    }
    shown[R_WRIST] = shown[R_WRIST].or_else(|| point(&keypoints.right_hand, 0));
    shown[L_WRIST] = shown[L_WRIST].or_else(|| point(&keypoints.left_hand, 0));
    let nose_from_eyes = || {
        let eyes = middle(body(coco::R_EYE), body(coco::L_EYE))?;
        let neck = middle(shown[R_SHOULDER].filter(|_| shown[L_SHOULDER].is_some()), shown[L_SHOULDER])?;
        Some([0, 1].map(|k| eyes[k] + NOSE_BELOW_EYES * (neck[k] - eyes[k])))
    };
    shown[NOSE] = shown[NOSE].or_else(nose_from_eyes).or_else(|| middle(body(coco::R_EAR), body(coco::L_EAR)));
    shown
}

/// The middle of two points, or the one that is there.
fn middle(a: Option<[f32; 2]>, b: Option<[f32; 2]>) -> Option<[f32; 2]> {
    match (a, b) {
        (Some(a), Some(b)) => Some([0, 1].map(|k| (a[k] + b[k]) / 2.0)),
        (one, other) => one.or(other),
    }
}

/// Takes out the points that lie far from the median of the frames around, as far as those agree.
fn remove_strays(points: &mut Array3<f32>, reach: usize) {
    let n_frames = points.shape()[0];
    let largest: Vec<f32> = (0..n_frames).map(|t| largest_bone(points, t)).collect();
    let mut strays = Vec::new();
    let mut around = Vec::with_capacity(2 * reach);
    for t in 0..n_frames {
        let frames = t.saturating_sub(reach)..n_frames.min(t + reach + 1);
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
            // No direction is preferred: of an even number the mean of the two in the middle.
            let usual = [0, 1].map(|k| median(around.iter().map(|p| p[k])).unwrap_or(f32::NAN));
            let away = |p: &[f32; 2]| (p[0] - usual[0]).hypot(p[1] - usual[1]);
            if away(&own) > STRAY * largest + STRAY_SPREAD * around.iter().map(away).fold(0.0, f32::max) {
                strays.push((t, j));
            }
        }
    }
    for (t, j) in strays {
        points.slice_mut(s![t, j, ..]).fill(f32::NAN);
    }
}

fn at(points: &Array3<f32>, t: usize, j: usize) -> Option<[f32; 2]> {
    let point = [points[[t, j, 0]], points[[t, j, 1]]];
    (!point[0].is_nan()).then_some(point)
}

/// The largest bone as it appears in a frame; NaN when none does.
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

    /// A speaker whose right wrist swings 120 px wide at `hertz`, 15 frames a second.
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

    fn sight(keypoints: &Keypoints) -> ObservedBody {
        ObservedBody::from_keypoints(keypoints, Interval { start: 0, end: keypoints.n_frames() }, 2, 15)
    }

    #[test]
    fn strays_go_and_fast_gestures_stay() {
        for hertz in [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5] {
            let keypoints = beating(60, hertz);
            assert!(sight(&keypoints).seen.slice(s![.., ..7]).iter().all(|seen| *seen), "{hertz} beats a second");
        }
        let mut keypoints = beating(60, 0.5);
        keypoints.body[[20, coco::R_WRIST, 0]] += 200.0;
        keypoints.body[[21, coco::L_SHOULDER, 1]] -= 90.0;
        keypoints.body.slice_mut(s![40.., .., 0]).mapv_inplace(|x| x + 300.0); // the picture jumps: no stray
        let sight = sight(&keypoints);
        let gone: Vec<(usize, usize)> =
            sight.seen.slice(s![.., ..7]).indexed_iter().filter(|(_, seen)| !**seen).map(|(at, _)| at).collect();
        assert_eq!(gone, [(20, R_WRIST), (21, L_SHOULDER)]);
        let [x, y] = sight.frame(21)[L_SHOULDER].unwrap();
        assert!((x - 720.0).abs() < 1e-3 && (y - 260.0).abs() < 1e-3, "bridged from the frames beside");
    }

    #[test]
    fn time_has_no_direction() {
        let mut forth = beating(50, 1.3);
        forth.body[[20, coco::R_WRIST, 1]] += 150.0;
        forth.body.slice_mut(s![30..35, coco::L_ELBOW, ..]).fill(0.0);
        let mut back = forth.clone();
        back.body.invert_axis(ndarray::Axis(0));
        let (forth, back) = (sight(&forth), sight(&back));
        for t in 0..50 {
            assert_eq!(forth.seen.row(t), back.seen.row(49 - t));
            for (a, b) in forth.frame(t).iter().flatten().zip(back.frame(49 - t).iter().flatten()) {
                assert!((a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn what_stands_in_for_what() {
        let mut keypoints = beating(30, 1.0);
        keypoints.body.slice_mut(s![.., coco::NOSE, ..]).fill(0.0);
        keypoints.body.slice_mut(s![.., coco::L_WRIST, ..]).fill(0.0);
        keypoints.left_hand.slice_mut(s![.., 0, ..]).assign(&ndarray::arr1(&[690.0, 450.0, 0.9]));
        keypoints.body.slice_mut(s![5..25, coco::R_ELBOW, 2]).fill(0.0);
        keypoints.body[[3, coco::R_WRIST, 0]] = 1e20;
        let sight = sight(&keypoints);
        assert_eq!(sight.frame(7)[NOSE], Some([640.0, 175.0]));
        assert_eq!(sight.frame(7)[L_WRIST], Some([690.0, 450.0]));
        assert!(sight.frame(7)[R_ELBOW].is_none() && sight.frame(3)[R_ELBOW].is_some(), "a long gap stays open");
        assert!(!sight.seen[[3, R_WRIST]] && sight.frame(3)[R_WRIST].is_some());
    }
}
