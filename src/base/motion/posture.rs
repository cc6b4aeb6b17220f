//! Posture of trunk and head from keypoints: the head from the face, the trunk's yaw from the lifted shoulders, its
//! lean and roll from the line between hips and neck. The clip's median upright direction is taken as vertical,
//! because keypoints do not reveal the camera's tilt. Without lifted hips the roll is measured in the picture, without
//! any hips it is a fraction of the shoulders' tilt, and the lean is unknown.

use super::face;
use crate::math::order::{median, upper_median};
use crate::math::rotation::Rotation;
use crate::math::vec3::{Vec3, add, scale, sub, unit};
use crate::types::pose2d::{VISIBLE_SCORE, coco};
use crate::types::posture::Posture;
use crate::types::skeleton::{L_SHOULDER, R_SHOULDER};
use ndarray::{ArrayView2, ArrayView3};

/// Lifted joints of the same frames.
#[derive(Clone, Copy, Debug, Default)]
pub struct LiftedBody<'a> {
    /// Joints [T, 49, 3] relative to the neck, metres: x image right, y down, z away.
    pub joints: Option<ArrayView3<'a, f32>>,
    /// Nose, right hip, left hip [T, 3, 3] in the same axes.
    pub extra: Option<ArrayView3<'a, f32>>,
}

/// Minimum length of a line with a defined direction, metres or px.
const MIN_LENGTH: f64 = 1e-5;
/// Trunk roll as a fraction of the shoulders' tilt (rendered persons: 0.3 to 0.7, correlation 0.9).
const ROLL_OF_TILT: f64 = 0.5;
/// Minimum fraction of the frames in which the hips are visible for them to be used.
const HIPS_SHARE: f64 = 0.5;
/// COCO-17 indices of left and right knee.
const KNEES: [usize; 2] = [13, 14];
/// Minimum fraction of the frames with hip and knee for `is_seated`.
const KNEES_SHARE: f64 = 0.2;
/// Maximum ratio of the height from hip to knee to that from shoulder to hip of a seated person, in the picture: 0.8
/// standing, -0.2 to 0.3 seated; pose models guess knees below the picture's edge at 0.5.
const SEATED_BELOW: f64 = 0.4;

/// Estimates the posture for the frames of the keypoints [T, 17, 3] (COCO; x px, y px, score).
pub fn estimate(body: ArrayView3<f32>, lifted: LiftedBody) -> Posture {
    let n_frames = body.shape()[0];
    let mut posture = Posture::missing(n_frames);
    for (t, angles) in face::angles(body).into_iter().enumerate() {
        let angles = angles.unwrap_or([f64::NAN; 3]);
        (0..3).for_each(|k| posture.head[[t, k]] = angles[k] as f32);
    }
    let of = |all: Option<ArrayView3<f32>>, t: usize, row: usize| -> Option<Vec3> {
        let frame = all.filter(|all| t < all.shape()[0])?;
        let position = [0, 1, 2].map(|k| f64::from(frame[[t, row, k]]) * if k == 0 { 1.0 } else { -1.0 });
        position.iter().all(|v| v.is_finite()).then_some(position)
    };
    let up = |t: usize| {
        let [right, left] = [1, 2].map(|hip| of(lifted.extra, t, hip));
        unit(scale(add(right?, left?), -0.5), MIN_LENGTH)
    };
    let shoulders = |t: usize| Some(sub(of(lifted.joints, t, L_SHOULDER)?, of(lifted.joints, t, R_SHOULDER)?));
    let ups: Vec<Option<Vec3>> = (0..n_frames).map(up).collect();
    let upright = median_direction(&ups).filter(|_| is_mostly_visible(&ups));
    let level = upright.map_or(Rotation::IDENTITY, |upright| Rotation::between(upright, [0.0, 1.0, 0.0]));
    let rolls = if upright.is_some() { Vec::new() } else { picture_rolls(body) };
    for (t, &up) in ups.iter().enumerate() {
        let yaw = shoulders(t).map(|line| level.turn(line)).map(|[x, _, z]| (-z).atan2(x));
        let tilt = upright.and(up).map(|up| {
            let [x, y, z] = Rotation::about([0.0, 1.0, 0.0], -yaw.unwrap_or(0.0)).turn(level.turn(up));
            [z.atan2(y), -x.clamp(-1.0, 1.0).asin()]
        });
        let roll = tilt.map(|tilt| tilt[1]).or_else(|| rolls.get(t).copied().flatten());
        let angles = [yaw, tilt.map(|tilt| tilt[0]), roll];
        (0..3).for_each(|k| posture.trunk[[t, k]] = angles[k].unwrap_or(f64::NAN) as f32);
    }
    posture
}

/// Returns the rows of an array [T, 3] for `n_frames`; `None` where an angle is missing or after the end of the array.
pub fn angles_of(rows: ArrayView2<f32>, n_frames: usize) -> Vec<Option<Vec3>> {
    let row = |t: usize| {
        let row = (t < rows.shape()[0]).then(|| [0, 1, 2].map(|k| f64::from(rows[[t, k]])))?;
        row.iter().all(|v| v.is_finite()).then_some(row)
    };
    (0..n_frames).map(row).collect()
}

/// Returns whether the person of the keypoints [T, 17, 3] is seated, from the median height of the thighs relative to
/// the trunk; `None` if hips and knees are visible in less than a fifth of the frames.
pub fn is_seated(body: ArrayView3<f32>) -> Option<bool> {
    let drops: Vec<Option<f64>> = body
        .outer_iter()
        .map(|frame| {
            let shoulder = middle(&frame, [coco::L_SHOULDER, coco::R_SHOULDER])?;
            let hip = middle(&frame, [coco::L_HIP, coco::R_HIP])?;
            let knee = middle(&frame, KNEES)?;
            let trunk = hip[1] - shoulder[1];
            (trunk > 1.0).then(|| (knee[1] - hip[1]) / trunk)
        })
        .collect();
    let n_visible = drops.iter().flatten().count();
    if (n_visible as f64) < KNEES_SHARE * drops.len() as f64 {
        return None;
    }
    Some(median(drops.into_iter().flatten())? < SEATED_BELOW)
}

/// Returns rolls towards the right shoulder relative to the clip's median, radians, from the line between hips and
/// neck in the picture, or from the shoulders if the hips are rarely visible.
fn picture_rolls(body: ArrayView3<f32>) -> Vec<Option<f64>> {
    let trunk = |frame: ArrayView2<f32>| {
        let neck = middle(&frame, [coco::L_SHOULDER, coco::R_SHOULDER])?;
        let hip = middle(&frame, [coco::L_HIP, coco::R_HIP])?;
        (hip[1] - neck[1] > 1.0).then(|| (hip[0] - neck[0]).atan2(hip[1] - neck[1]))
    };
    let shoulders = |frame: ArrayView2<f32>| {
        let [left, right] = [coco::L_SHOULDER, coco::R_SHOULDER].map(|point| seen(&frame, point));
        let (left, right) = (left?, right?);
        let tilt = (right[1] - left[1]).atan2((left[0] - right[0]).abs().max(1.0));
        Some(ROLL_OF_TILT * tilt)
    };
    let by_hips: Vec<Option<f64>> = body.outer_iter().map(trunk).collect();
    let is_by_hips = by_hips.iter().flatten().count() as f64 >= HIPS_SHARE * by_hips.len() as f64;
    let rolls = if is_by_hips { by_hips } else { body.outer_iter().map(shoulders).collect() };
    let level = median(rolls.iter().copied().flatten()).unwrap_or(0.0);
    rolls.into_iter().map(|roll| Some(roll? - level)).collect()
}

/// Midpoint of two visible points, px.
fn middle(frame: &ArrayView2<f32>, points: [usize; 2]) -> Option<[f64; 2]> {
    let [a, b] = points.map(|point| seen(frame, point));
    let (a, b) = (a?, b?);
    Some([0, 1].map(|k| (a[k] + b[k]) / 2.0))
}

fn seen(frame: &ArrayView2<f32>, point: usize) -> Option<[f64; 2]> {
    let [x, y, score] = [0, 1, 2].map(|k| frame[[point, k]]);
    (x.is_finite() && y.is_finite() && score >= VISIBLE_SCORE).then_some([f64::from(x), f64::from(y)])
}

fn is_mostly_visible(directions: &[Option<Vec3>]) -> bool {
    let n_visible = directions.iter().flatten().count();
    n_visible > 0 && n_visible as f64 >= HIPS_SHARE * directions.len() as f64
}

fn median_direction(directions: &[Option<Vec3>]) -> Option<Vec3> {
    let along = |k: usize| upper_median(directions.iter().flatten().map(|direction| direction[k]));
    unit([along(0)?, along(1)?, along(2)?], MIN_LENGTH)
}
