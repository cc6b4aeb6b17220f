//! Joint positions to bone rotations by swing and twist. The shoulders' yaw goes half to the spine and half to the
//! chest; the clavicle swings; arms and hands are in `arm`. Forward kinematics returns the joints wherever bones keep
//! their length and palms their shape, apart from smoothing.

use super::arm;
use super::arm::SolveFilters;
use super::positions::JointPositions;
use super::track::{RotationTrack, filled, mirrored};
use crate::animate::rig::rig::Rig;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::Vec3;

/// Local rotations by joint of the rig. Hips, neck, head and legs rest.
pub fn rotations(positions: &JointPositions, rig: &Rig, filters: &SolveFilters) -> Vec<RotationTrack> {
    let n_frames = positions.n_frames();
    let mut local: Vec<RotationTrack> = vec![vec![Rotation::IDENTITY; n_frames]; rig.skeleton.joints.len()];

    let mut line: Vec<Option<Vec3>> = (0..n_frames).map(|t| positions.shoulder_line(t)).collect();
    filters.arms.directions(&mut line, &[]);
    let half_yaw = |[x, _, z]: Vec3| Rotation::about([0.0, 1.0, 0.0], (-z).atan2(x) / 2.0);
    let half_yaw = filled(line.into_iter().map(|line| line.map(half_yaw)).collect(), Rotation::IDENTITY, None);
    let chest: RotationTrack = half_yaw.iter().map(|&half| half * half).collect();
    local[rig.spine].clone_from(&half_yaw);
    local[rig.chest] = half_yaw;

    let [left, right] = &rig.arms;
    arm::solve(positions, left, &chest, filters, &mut local);
    arm::solve(&positions.mirrored(), right, &mirrored(chest), filters, &mut local);
    let fingers = right.fingers.iter().flatten();
    for &joint in [right.clavicle, right.upper, right.fore, right.hand].iter().chain(fingers) {
        local[joint] = mirrored(std::mem::take(&mut local[joint]));
    }
    local
}
