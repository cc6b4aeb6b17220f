//! Head rotation from face keypoints: a rigid face of eyes, ears and nose is fit_all under weak perspective by least
//! squares with a prior. Faces differ from the rigid one, so the clip's median pitch is taken as looking straight
//! ahead. Face and weights were fit_all to the keypoints of pose models on rendered heads (34 clips; on 68 clips of
//! other bodies the median yaw error is 3 degrees, at most 5 in any range of ten degrees up to 60).

use crate::math::order::upper_median;
use crate::math::rotation::Rotation;
use crate::math::vec3::Vec3;
use crate::types::pose2d::{VISIBLE_SCORE, coco};
use ndarray::{ArrayView2, ArrayView3, Axis};

/// Nose, left and right eye, left and right ear at the positions that pose models detect, in metres from the middle
/// between the ears; x to the person's left, y up, z forward.
const FACE: [Vec3; 5] =
    [[0.0, 0.011, 0.108], [0.041, 0.021, 0.068], [-0.041, 0.021, 0.068], [0.092, 0.0, 0.0], [-0.092, 0.0, 0.0]];
/// Standard deviation between a keypoint and the rigid face, metres.
const POINT_METRES: f64 = 0.010;
/// Sine of the yaw at which the ear that is turned away has half its weight; pose models guess its position.
const EAR_HIDDEN: f64 = 0.25;
/// Exponent that turns a keypoint's score into its weight.
const SCORE_POWER: i32 = 3;
/// Minimum number of visible face keypoints for a head rotation.
const MIN_POINTS: usize = 3;
/// Shoulder width of an adult in metres, for the initial scale.
const SHOULDERS_METRES: f64 = 0.36;
/// Prior: standard deviations of yaw, pitch, roll (degrees) and of the logarithm of the scale; the latter in the first
/// fit, and in the second, which uses the clip's median.
const USUAL_DEGREES: Vec3 = [45.0, 25.0, 20.0];
const USUAL_SCALE: [f64; 2] = [0.3, 0.08];
const STEPS: usize = 8;

/// Estimates yaw (to the person's left), pitch (down, relative to the clip's median) and roll (towards the right
/// shoulder) of the head in camera axes, in radians, for each frame of the keypoints [T, 17, 3]; `None` where too few
/// face keypoints are visible.
pub fn angles(body: ArrayView3<f32>) -> Vec<Option<Vec3>> {
    let points: Vec<Option<FacePoints>> = body.axis_iter(Axis(0)).map(FacePoints::from_keypoints).collect();
    let Some(scale) = upper_median(points.iter().flatten().filter_map(|points| points.shoulder_scale))
        .or_else(|| upper_median(points.iter().flatten().map(|points| points.spread() / 0.1)))
    else {
        return vec![None; points.len()];
    };
    let fit_all = |scale: f64, nod: f64, usual: f64| -> Vec<Option<[f64; 4]>> {
        points.iter().map(|points| Some(points.as_ref()?.fit([0.0, nod, 0.0, scale.ln()], usual))).collect()
    };
    let median_of = |fits: &[Option<[f64; 4]>], k: usize| upper_median(fits.iter().flatten().map(|fit| fit[k]));
    let first = fit_all(scale, 0.0, USUAL_SCALE[0]);
    let (nod, log_scale) = (median_of(&first, 1).unwrap_or(0.0), median_of(&first, 3).unwrap_or(scale.ln()));
    let second = fit_all(log_scale.exp(), nod, USUAL_SCALE[1]);
    let nod = median_of(&second, 1).unwrap_or(0.0);
    second.iter().map(|fit| fit.map(|[yaw, pitch, roll, _]| [yaw, pitch - nod, roll])).collect()
}

/// Rotation by yaw (to the person's left), pitch (down) and roll (towards the right shoulder), radians.
pub fn rotation([yaw, pitch, roll]: Vec3) -> Rotation {
    Rotation::about([0.0, 1.0, 0.0], yaw)
        * Rotation::about([1.0, 0.0, 0.0], pitch)
        * Rotation::about([0.0, 0.0, 1.0], roll)
}

/// Face keypoints of one frame: px (y up) with weights, 0 if not visible. A weight is a power of the score, because
/// hidden ears are predicted with only slightly lower scores.
struct FacePoints {
    positions: [[f64; 2]; 5],
    weights: [f64; 5],
    /// Pixels per metre, estimated from the width of the shoulders.
    shoulder_scale: Option<f64>,
}

impl FacePoints {
    fn from_keypoints(body: ArrayView2<f32>) -> Option<Self> {
        let at = |point: usize| [f64::from(body[[point, 0]]), -f64::from(body[[point, 1]])];
        let seen = |point: usize| (0..3).all(|k| body[[point, k]].is_finite()) && body[[point, 2]] >= VISIBLE_SCORE;
        let weights: [f64; 5] =
            std::array::from_fn(
                |point| if seen(point) { f64::from(body[[point, 2]]).min(1.0).powi(SCORE_POWER) } else { 0.0 },
            );
        if weights.iter().filter(|&&weight| weight > 0.0).count() < MIN_POINTS {
            return None;
        }
        let [[lx, ly], [rx, ry]] = [at(coco::L_SHOULDER), at(coco::R_SHOULDER)];
        let shoulders = seen(coco::L_SHOULDER) && seen(coco::R_SHOULDER);
        let width = (lx - rx).hypot(ly - ry) / SHOULDERS_METRES;
        let shoulder_scale = (shoulders && width > 1.0).then_some(width);
        Some(Self {
            positions: std::array::from_fn(|point| if seen(point) { at(point) } else { [0.0; 2] }),
            weights,
            shoulder_scale,
        })
    }

    /// Horizontal extent of the visible points, px.
    fn spread(&self) -> f64 {
        let seen = || {
            self.positions.iter().zip(self.weights).filter(|(_, weight)| *weight > 0.0).map(|(position, _)| position[0])
        };
        (seen().fold(f64::MIN, f64::max) - seen().fold(f64::MAX, f64::min)).max(1.0)
    }

    /// Fits yaw, pitch, roll and log scale (px per metre) by Gauss-Newton; `usual` is the initial value and the mean
    /// of the prior, `usual_scale` the prior's standard deviation of the log scale.
    fn fit(&self, usual: [f64; 4], usual_scale: f64) -> [f64; 4] {
        let [yaw, pitch, roll] = USUAL_DEGREES.map(|degrees| 1.0 / degrees.to_radians().powi(2));
        let certain = [yaw, pitch, roll, 1.0 / usual_scale.powi(2)];
        let mut fit = usual;
        for _ in 0..STEPS {
            let weights = self.weights(fit[0]);
            let errors = self.errors(fit, &weights);
            // Central differences, so that a mirrored face gives exactly the mirrored rotation.
            let slopes: [[[f64; 2]; 5]; 4] = std::array::from_fn(|k| {
                let [up, down] = [1e-4, -1e-4].map(|step| {
                    let mut beside = fit;
                    beside[k] += step;
                    self.errors(beside, &weights)
                });
                std::array::from_fn(|n| std::array::from_fn(|axis| (up[n][axis] - down[n][axis]) / 2e-4))
            });
            let product = |a: &[[f64; 2]; 5], b: &[[f64; 2]; 5]| -> f64 {
                (0..5).map(|n| weights[n] * (a[n][0] * b[n][0] + a[n][1] * b[n][1])).sum()
            };
            let mut matrix = [[0.0; 4]; 4];
            let mut right = [0.0; 4];
            for i in 0..4 {
                (0..4).for_each(|k| matrix[i][k] = product(&slopes[i], &slopes[k]));
                matrix[i][i] += certain[i];
                right[i] = -product(&slopes[i], &errors) - certain[i] * (fit[i] - usual[i]);
            }
            let step = solved(matrix, right);
            (0..4).for_each(|k| fit[k] += step[k].clamp(-0.5, 0.5));
        }
        fit
    }

    /// Weights at a given yaw: the ear that is turned away is down-weighted if the other one is visible.
    fn weights(&self, yaw: f64) -> [f64; 5] {
        let mut weights = self.weights;
        for (ear, other, turned) in [(3, 4, yaw.sin()), (4, 3, -yaw.sin())] {
            if self.weights[other] > 0.0 {
                weights[ear] /= 1.0 + (turned.max(0.0) / EAR_HIDDEN).powi(4);
            }
        }
        weights
    }

    /// Residuals of the rigid face and the keypoints, both relative to their weighted mean, in units of `POINT_METRES`.
    fn errors(&self, [yaw, pitch, roll, log_scale]: [f64; 4], weights: &[f64; 5]) -> [[f64; 2]; 5] {
        let (turned, scale) = (rotation([yaw, pitch, roll]), log_scale.exp());
        let offsets: [[f64; 2]; 5] = std::array::from_fn(|n| {
            let [x, y, _] = turned.turn(FACE[n]);
            [x - self.positions[n][0] / scale, y - self.positions[n][1] / scale]
        });
        let total: f64 = weights.iter().sum();
        let mean = [0, 1].map(|axis| (0..5).map(|n| weights[n] * offsets[n][axis]).sum::<f64>() / total);
        offsets.map(|offset| [0, 1].map(|axis| (offset[axis] - mean[axis]) / POINT_METRES))
    }
}

/// Solves a positive definite 4 x 4 system by elimination.
fn solved(mut matrix: [[f64; 4]; 4], mut right: [f64; 4]) -> [f64; 4] {
    for pivot in 0..4 {
        for row in pivot + 1..4 {
            let share = matrix[row][pivot] / matrix[pivot][pivot];
            (pivot..4).for_each(|k| matrix[row][k] -= share * matrix[pivot][k]);
            right[row] -= share * right[pivot];
        }
    }
    let mut found = [0.0; 4];
    for row in (0..4).rev() {
        let known: f64 = (row + 1..4).map(|k| matrix[row][k] * found[k]).sum();
        found[row] = (right[row] - known) / matrix[row][row];
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Projects a face of a different size than the rigid one at 400 px per metre.
    fn drawn(angles: Vec3, hidden: &[usize]) -> FacePoints {
        let project = |point: Vec3| {
            let [x, y, _] = rotation(angles).turn(point.map(|v| 1.05 * v));
            [640.0 + 400.0 * x, -200.0 + 400.0 * y]
        };
        let weights = std::array::from_fn(|n| if hidden.contains(&n) { 0.0 } else { 0.9 });
        FacePoints { positions: FACE.map(project), weights, shoulder_scale: None }
    }

    #[test]
    fn rotation_of_a_projected_face_is_recovered_and_mirrors_exactly() {
        for (angles, hidden) in [
            ([0.0, 0.0, 0.0], &[][..]),
            ([0.5, 0.1, -0.1], &[]),
            ([-0.7, -0.2, 0.2], &[3]),
            ([0.2, 0.3, 0.0], &[4]),
            ([0.9, 0.0, 0.1], &[2, 4]),
        ] {
            let fit = drawn(angles, hidden).fit([0.0, 0.0, 0.0, 420f64.ln()], 0.08);
            for k in 0..3 {
                assert!((fit[k] - angles[k]).abs() < 0.12, "{angles:?} {fit:?}");
            }
            let mut other = drawn(angles, hidden);
            other.positions.iter_mut().for_each(|position| position[0] *= -1.0);
            other.positions.swap(1, 2);
            other.positions.swap(3, 4);
            other.weights.swap(1, 2);
            other.weights.swap(3, 4);
            let twin = other.fit([0.0, 0.0, 0.0, 420f64.ln()], 0.08);
            assert!(
                (fit[0] + twin[0]).abs() < 1e-9 && (fit[1] - twin[1]).abs() < 1e-9 && (fit[2] + twin[2]).abs() < 1e-9
            );
        }
    }
}
