//! Two-bone inverse kinematics.

use orator_base::math::vec3::{Vec3, across, add, any_across, norm, scale, sub, unit};

/// Maximum extension of an arm relative to its total length.
const MAX_STRETCH: f64 = 0.9995;

/// Positions of the middle joint and the end of two bones with the given lengths that start at `from`. The end is at
/// `to`, or as near as possible if that is out of reach; the middle joint is on the side of `elbow`.
pub fn solve_two_bone(from: Vec3, elbow: Vec3, to: Vec3, [upper, forearm]: [f64; 2]) -> [Vec3; 2] {
    let way = sub(to, from);
    let towards = sub(elbow, from);
    let along = unit(way, 1e-9).or_else(|| unit(towards, 1e-9)).unwrap_or([1.0, 0.0, 0.0]);
    let far = (upper + forearm) * MAX_STRETCH;
    let near = (upper - forearm).abs() / MAX_STRETCH;
    let distance = norm(way).clamp(near.min(far), far).max(1e-9);
    let side = across(towards, along);
    let side = unit(side, 1e-9).unwrap_or_else(|| any_across(along));
    let share = ((upper * upper + distance * distance - forearm * forearm) / (2.0 * upper * distance)).clamp(-1.0, 1.0);
    let middle = add(scale(along, upper * share), scale(side, upper * (1.0 - share * share).sqrt()));
    [add(from, middle), add(from, scale(along, distance))]
}
