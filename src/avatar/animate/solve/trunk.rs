//! Lean and roll of the trunk, and breathing: hips, spine and chest rotate, while arms and head keep their world
//! rotation, so that joint positions relative to the neck do not change.

use super::arm::SolveFilters;
use super::legs::Legs;
use super::track::{RotationTrack, filled};
use crate::animate::rig::rig::Rig;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, norm};
use orator_base::types::posture::Posture;
use orator_formats::bvh::write::BvhClip;

/// Fractions of lean and roll by which hips, spine and chest rotate in the world, so that the line from the hips to the
/// neck leans by the complete angle; without and with the hips.
const ABOVE_HIPS: [f64; 3] = [0.0, 1.15, 1.35];
const WITH_HIPS: [f64; 3] = [0.7, 1.05, 1.1];
/// Range of lean and roll, degrees.
const LEAN: [f64; 2] = [-20.0, 60.0];
const ROLL: [f64; 2] = [-30.0, 30.0];
/// Time in which an undetected trunk returns to upright, seconds.
const RELAX_SECS: f64 = 1.0;
/// Displacement of the neck by a breath, cm.
const BREATH_CM: f64 = 0.3;
/// Duration of a breath at rest, seconds.
const BREATH_SECS: f64 = 4.2;
const X: Vec3 = [1.0, 0.0, 0.0];
const Z: Vec3 = [0.0, 0.0, 1.0];

/// Rotates the trunk of a clip whose only trunk rotation so far is yaw.
pub fn turn(
    posture: Option<&Posture>,
    legs: Legs,
    has_breath: bool,
    rig: &Rig,
    filters: &SolveFilters,
    clip: &mut BvhClip,
) {
    let n_frames = clip.n_frames();
    let track = |column: usize, axis: Vec3, range: [f64; 2]| {
        posture.and_then(|posture| angle_track(posture, column, axis, range, n_frames, filters))
    };
    let (lean, roll) = (track(1, X, LEAN), track(2, Z, ROLL));
    let is_seen = lean.is_some() || roll.is_some();
    if !is_seen && !has_breath {
        return;
    }
    let lever = norm(rig.skeleton.joints[rig.neck].offset).max(1.0);
    let shares = if legs == Legs::None { ABOVE_HIPS } else { WITH_HIPS };
    for (t, local) in clip.local.iter_mut().enumerate() {
        let part = |track: &Option<RotationTrack>, share: f64| {
            track.as_ref().map_or(Rotation::IDENTITY, |track| Rotation::IDENTITY.slerp(track[t], share))
        };
        let yaw = [Rotation::IDENTITY, local[rig.spine], local[rig.spine] * local[rig.chest]];
        let ahead = yaw[2];
        let tilted = |n: usize| match is_seen {
            true => ahead * part(&lean, shares[n]) * part(&roll, shares[n]) * ahead.inverse() * yaw[n],
            false => yaw[n],
        };
        let breath = if has_breath { breath(clip.fps.secs(t)) / lever } else { 0.0 };
        let (hips, spine, chest) = (tilted(0), tilted(1), tilted(2) * Rotation::about(X, -breath));
        local[0] = hips;
        local[rig.spine] = hips.inverse() * spine;
        local[rig.chest] = spine.inverse() * chest;
        let back = chest.inverse() * ahead;
        for joint in [rig.arms[0].clavicle, rig.arms[1].clavicle, rig.neck] {
            local[joint] = back * local[joint];
        }
    }
}

/// Displacement of the neck by breathing, cm.
fn breath(secs: f64) -> f64 {
    BREATH_CM * (1.0 - (std::f64::consts::TAU * secs / BREATH_SECS).cos()) / 2.0
}

/// Rotations by one angle of the trunk, smoothed and without gaps; `None` if it was never detected.
fn angle_track(
    posture: &Posture,
    column: usize,
    axis: Vec3,
    range: [f64; 2],
    n_frames: usize,
    filters: &SolveFilters,
) -> Option<RotationTrack> {
    let [low, high] = range.map(f64::to_radians);
    let seen = |t: usize| posture.trunk.get([t, column]).copied().filter(|angle| angle.is_finite());
    let mut angles: Vec<Option<Vec3>> =
        (0..n_frames).map(|t| seen(t).map(|angle| [f64::from(angle).clamp(low, high), 0.0, 0.0])).collect();
    angles.iter().any(Option::is_some).then_some(())?;
    filters.arms.runs(&mut angles, &[]);
    let turned = angles.into_iter().map(|angle| angle.map(|[angle, ..]| Rotation::about(axis, angle)));
    Some(filled(turned.collect(), Rotation::IDENTITY, Some(RELAX_SECS * filters.fps)))
}
