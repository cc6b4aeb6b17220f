//! Wrists at their observed positions. The distance from neck to shoulder varies in a captured person and is constant
//! in the rig; the arm bends a little more or less to compensate for it.

use super::positions::JointPositions;
use super::smoothing::Filter;
use super::track::{RotationTrack, smoothstep};
use crate::animate::retarget::two_bone::solve_two_bone;
use orator_base::math::order::upper_median;
use orator_base::math::vec3::{Vec3, add, dot, norm, scale, sub, unit};
use orator_base::types::skeleton::{L_ELBOW, L_SHOULDER, L_WRIST, NECK};

/// Maximum share by which the rig's bones differ from the motion's. With other bones, the arm keeps its directions.
const SAME_LENGTH: f64 = 0.03;
/// Elbow angles, degrees (0 is straight), between which the weight of the wrist's position rises from 0 to 1: in a
/// straight arm a small change of the distance moves the elbow a lot.
const STRAIGHT_DEGREES: [f64; 2] = [20.0, 45.0];

/// Turns the left upper arm and forearm, given by their directions in the clavicle's axes, so that the wrist is at its
/// smoothed position relative to the neck. `metres`: clavicle, upper arm, forearm; `chest`, `clavicle`: world rotations.
pub fn reach(
    positions: &JointPositions,
    metres: [f64; 3],
    (chest, clavicle): (&RotationTrack, &RotationTrack),
    filter: &Filter,
    (along, fore): (&mut [Option<Vec3>], &mut [Option<Vec3>]),
) {
    let bones = [(NECK, L_SHOULDER), (L_SHOULDER, L_ELBOW), (L_ELBOW, L_WRIST)];
    let is_same = |((from, to), metres): ((usize, usize), f64)| {
        let lengths = (0..positions.n_frames()).filter_map(|t| Some(norm(positions.offset(t, from, to)?)));
        upper_median(lengths).is_some_and(|length| (length - metres).abs() < SAME_LENGTH * length)
    };
    if !bones.into_iter().zip(metres).all(is_same) {
        return;
    }
    let [shoulder, upper, forearm] = metres;
    // In units of the forearm's length, because the filter's tolerance is an angle.
    let from_neck = |t: usize| Some(scale(chest[t].inverse().turn(positions.offset(t, NECK, L_WRIST)?), 1.0 / forearm));
    let mut wrists: Vec<Option<Vec3>> = (0..positions.n_frames()).map(from_neck).collect();
    filter.runs(&mut wrists, &[]);
    for (t, wrist) in wrists.into_iter().enumerate() {
        let (Some(wrist), Some(along), Some(fore)) = (wrist, along[t].as_mut(), fore[t].as_mut()) else { continue };
        let to = sub(clavicle[t].inverse().turn(chest[t].turn(scale(wrist, forearm))), [shoulder, 0.0, 0.0]);
        let weight = smoothstep(STRAIGHT_DEGREES, dot(*along, *fore).clamp(-1.0, 1.0).acos().to_degrees());
        let before = [scale(*along, upper), add(scale(*along, upper), scale(*fore, forearm))];
        let [elbow, _] = solve_two_bone([0.0; 3], before[0], to, [upper, forearm]);
        let weighted = |from: Vec3, to: Vec3| add(scale(from, 1.0 - weight), scale(to, weight));
        *along = unit(weighted(before[0], elbow), 1e-9).unwrap_or(*along);
        *fore = unit(sub(weighted(before[1], to), scale(*along, upper)), 1e-9).unwrap_or(*fore);
    }
}
