//! Head and neck from a posture: each has half the head's rotation relative to the chest; if not detected, they relax.

use super::arm::SolveFilters;
use super::track::{ObservedTrack, RotationTrack, filled};
use crate::animate::rig::rig::Rig;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::Vec3;
use orator_base::motion::face::rotation;
use orator_base::motion::posture::angles_of;
use orator_base::types::posture::Posture;

/// Maximum yaw, pitch and roll relative to the chest, degrees (normal range of the neck, AAOS: 80, 45, 45).
const LIMITS: Vec3 = [80.0, 45.0, 45.0];
/// Time in which an undetected head returns to rest, seconds.
const RELAX_SECS: f64 = 0.5;

/// Rotates neck and head; returns the number of frames in which the head was detected.
pub fn turn(posture: &Posture, rig: &Rig, filters: &SolveFilters, local: &mut [RotationTrack]) -> usize {
    let n_frames = local[rig.head].len();
    let mut angles = angles_of(posture.head.view(), n_frames);
    if angles.iter().all(Option::is_none) {
        return 0;
    }
    filters.hands.runs(&mut angles, &[]);
    let limits = LIMITS.map(f64::to_radians);
    let halves: ObservedTrack = angles
        .into_iter()
        .enumerate()
        .map(|(t, angles)| {
            let chest = local[0][t] * local[rig.spine][t] * local[rig.chest][t];
            let against = chest.inverse() * rotation(angles?);
            let [yaw, pitch, roll] = against.euler([1, 0, 2]);
            let [yaw, pitch, roll] = [0, 1, 2].map(|k| [yaw, pitch, roll][k].clamp(-limits[k], limits[k]));
            Some(Rotation::IDENTITY.slerp(rotation([yaw, pitch, roll]), 0.5))
        })
        .collect();
    let n_visible = halves.iter().flatten().count();
    let halves = filled(halves, Rotation::IDENTITY, Some(RELAX_SECS * filters.fps));
    local[rig.neck].clone_from(&halves);
    local[rig.head] = halves;
    n_visible
}
