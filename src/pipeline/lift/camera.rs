//! Camera tilt over an interval: roll and pitch. Keypoints do not show the vertical, so the speaker's torso replaces
//! it, assumed to be upright on average; a posture held throughout (leaning over a desk) is attributed to the camera.
//! For upright bodies filmed at known angles (roll within 14, pitch -14 to 23 degrees) the median error is 2.4 degrees
//! for roll and 7.8 for pitch (`tests/it/lift/lift_camera.rs`); torsos with an apparent lean of 15.2 degrees lean by
//! 1.8 after levelling. Hips that the detector guessed are no better than no estimate.

use super::lifter::IntervalView;
use ndarray::{ArrayViewMut3, Axis};
use orator_base::math::order::lower_median;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::interval::Interval;
use orator_base::types::skeleton::{L_SHOULDER, R_SHOULDER};
use serde::Serialize;

/// Least share of the frames of an interval with hips for an estimate from the torso.
const MIN_HIPS_SHARE: f64 = 0.5;
/// Without hips, roll is estimated from the shoulders if the speaker is turned by less than this angle (20 degrees,
/// here in radians); the median error is then 4 degrees for cameras that roll up to 17, and more than 10 beyond.
const MAX_FRONTAL_ANGLE: f32 = 0.36;

/// Camera tilt over an interval; `None`: cannot be estimated.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CameraTilt {
    #[serde(flatten)]
    pub interval: Interval,
    /// Roll: angle by which an upright speaker appears to lean to the right of the picture.
    pub roll_degrees: Option<f64>,
    /// Pitch: how far the camera looks down on the speaker; negative: up.
    pub pitch_degrees: Option<f64>,
}

impl CameraTilt {
    /// Estimates the tilt from a lifted interval: joints relative to the neck, extra points nose, right hip, left hip.
    pub(crate) fn estimate(interval: Interval, lifted: &IntervalView) -> Self {
        let up = up_by_hips(lifted);
        let roll = up.map(|up| up[0].atan2(-up[1])).or_else(|| roll_by_shoulders(lifted));
        let pitch = up.map(|up| (-up[2]).atan2(up[0].hypot(up[1])));
        Self { interval, roll_degrees: roll.map(f64::to_degrees), pitch_degrees: pitch.map(f64::to_degrees) }
    }

    /// Rotates the interval to the view of a level camera, as far as roll and pitch are known.
    pub(crate) fn level(&self, lifted: &mut IntervalView) {
        let angle = |degrees: Option<f64>| degrees.unwrap_or(0.0).to_radians();
        let upright = Rotation::about([0.0, 0.0, 1.0], -angle(self.roll_degrees));
        let ahead = Rotation::about([1.0, 0.0, 0.0], -angle(self.pitch_degrees));
        let turn = ahead * upright;
        for points in [&mut lifted.joints, &mut lifted.extra] {
            rotate_all(points, turn);
        }
    }
}

fn rotate_all(points: &mut ArrayViewMut3<f32>, turn: Rotation) {
    for mut point in points.lanes_mut(Axis(2)) {
        let turned = turn.turn([0, 1, 2].map(|k| f64::from(point[k])));
        (0..3).for_each(|k| point[k] = turned[k] as f32);
    }
}

/// Median direction from the midpoint of the hips to the neck.
fn up_by_hips(lifted: &IntervalView) -> Option<Vec3> {
    let torso = |hips: ndarray::ArrayView2<f32>| -> Option<Vec3> {
        let middle = [0, 1, 2].map(|k| -0.5 * f64::from(hips[[1, k]] + hips[[2, k]]));
        vec3::unit(middle, 1e-6)
    };
    let torsos: Vec<Vec3> = lifted.extra.outer_iter().filter_map(torso).collect();
    if (torsos.len() as f64) < MIN_HIPS_SHARE * lifted.extra.len_of(Axis(0)) as f64 {
        return None;
    }
    let along = |k: usize| lower_median(torsos.iter().map(|up| up[k] as f32));
    vec3::unit([along(0)?.into(), along(1)?.into(), along(2)?.into()], 1e-6)
}

/// Median roll of the shoulders, if the speaker faces the camera.
fn roll_by_shoulders(lifted: &IntervalView) -> Option<f64> {
    let across = |k: usize| -> Vec<f32> {
        lifted.joints.outer_iter().map(|pose| pose[[L_SHOULDER, k]] - pose[[R_SHOULDER, k]]).collect()
    };
    let [x, y, z] = [0, 1, 2].map(across);
    let angle = |(a, b): (&f32, &f32)| a.atan2(b.abs());
    let turned = lower_median(z.iter().zip(&x).map(|(z, x)| z.abs().atan2(x.abs())))?;
    let roll = lower_median(y.iter().zip(&x).map(angle))?;
    (turned < MAX_FRONTAL_ANGLE).then_some(roll.into())
}
