//! Wrists at their observed positions. The distance from neck to shoulder varies in a captured person and is constant
//! in the rig; the arm bends a little more or less to compensate for it.

use super::positions::JointPositions;
use super::smoothing::Filter;
use super::track::{RotationTrack, smoothstep};
use crate::animate::retarget::two_bone::solve_two_bone;
use orator_base::math::order::upper_median;
use orator_base::math::vec3::{Vec3, add, dot, norm, scale, sub, unit};
use orator_base::types::skeleton::{L_ELBOW, L_SHOULDER, L_WRIST, NECK};

/// Maximum difference of the rig's bones from those of the motion, as a share. With other bones, the arm keeps its
/// directions.
const SAME_LENGTH: f64 = 0.03;
/// Elbow angles, degrees (0 is straight), between which the weight of the wrist's position rises from 0 to 1: in a
/// straight arm a small change of the distance moves the elbow a lot.
const STRAIGHT_DEGREES: [f64; 2] = [10.0, 30.0];

/// Turns the left upper arm and forearm, given by their directions in the clavicle's axes, so that the wrist is at its
/// smoothed position relative to the neck. `metres`: lengths of clavicle, upper arm and forearm in the rig;
/// `chest` and `clavicle`: world rotations.
pub fn reach(
    positions: &JointPositions,
    metres: [f64; 3],
    (chest, clavicle): (&RotationTrack, &RotationTrack),
    filter: &Filter,
    (along, fore): (&mut [Option<Vec3>], &mut [Option<Vec3>]),
) {
    let n_frames = positions.n_frames();
    let bones = [(NECK, L_SHOULDER), (L_SHOULDER, L_ELBOW), (L_ELBOW, L_WRIST)];
    let is_same = |((from, to), metres): ((usize, usize), f64)| {
        let lengths = (0..n_frames).filter_map(|t| Some(norm(positions.offset(t, from, to)?)));
        upper_median(lengths).is_some_and(|length| (length - metres).abs() < SAME_LENGTH * length)
    };
    if !bones.into_iter().zip(metres).all(is_same) {
        return;
    }
    let [shoulder, upper, forearm] = metres;
    // In lengths of the forearm, so that the filter's tolerance is an angle of it.
    let from_neck = |t: usize| Some(scale(chest[t].inverse().turn(positions.offset(t, NECK, L_WRIST)?), 1.0 / forearm));
    let mut wrists: Vec<Option<Vec3>> = (0..n_frames).map(from_neck).collect();
    filter.runs(&mut wrists, &[]);
    for (t, wrist) in wrists.into_iter().enumerate() {
        let (Some(wrist), Some(along), Some(fore)) = (wrist, along[t].as_mut(), fore[t].as_mut()) else { continue };
        let to = clavicle[t].inverse().turn(chest[t].turn(scale(wrist, forearm)));
        let to = sub(to, [shoulder, 0.0, 0.0]);
        let bent = dot(*along, *fore).clamp(-1.0, 1.0).acos().to_degrees();
        let weight = smoothstep(STRAIGHT_DEGREES, bent);
        let [elbow, _] = solve_two_bone([0.0; 3], scale(*along, upper), to, [upper, forearm]);
        let elbow = add(scale(*along, upper * (1.0 - weight)), scale(elbow, weight));
        *along = unit(elbow, 1e-9).unwrap_or(*along);
        *fore = unit(sub(to, scale(*along, upper)), 1e-9).unwrap_or(*fore);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::math::rotation::Rotation;
    use orator_base::types::pose3d::Motion;
    use orator_base::types::skeleton::N_JOINTS;
    use orator_base::types::time::FrameRate;

    const METRES: [f64; 3] = [0.16, 0.28, 0.25];

    /// Distance of the left wrist from its observed position, metres, by frame, for shoulders that move in and out.
    fn distances(along: Vec3, fore: Vec3, metres: [f64; 3]) -> Vec<f64> {
        let [along, fore] = [along, fore].map(|v| unit(v, 0.0).unwrap());
        let mut joints = ndarray::Array3::<f32>::zeros((61, N_JOINTS, 3));
        let mut wrists = Vec::new();
        for (t, mut frame) in joints.outer_iter_mut().enumerate() {
            let shoulder = [METRES[0] + 0.01 * (0.1 * (t as f64 - 30.0)).sin(), 0.0, 0.0];
            let elbow = add(shoulder, scale(along, METRES[1]));
            let wrist = add(elbow, scale(fore, METRES[2]));
            wrists.push(wrist);
            for (joint, [x, y, z]) in [(L_SHOULDER, shoulder), (L_ELBOW, elbow), (L_WRIST, wrist)] {
                (0..3).for_each(|k| frame[[joint, k]] = [x, -y, -z][k] as f32);
            }
        }
        let positions = JointPositions::from_motion(&Motion::from_joints(FrameRate::new(30, 1), joints));
        let rest = vec![Rotation::IDENTITY; 61];
        let (mut upper, mut lower) = (vec![Some(along); 61], vec![Some(fore); 61]);
        reach(&positions, metres, (&rest, &rest), &Filter::None, (&mut upper, &mut lower));
        let reached = |(upper, lower): (&Option<Vec3>, &Option<Vec3>)| {
            add([METRES[0], 0.0, 0.0], add(scale(upper.unwrap(), METRES[1]), scale(lower.unwrap(), METRES[2])))
        };
        let reached = upper.iter().zip(&lower).map(reached);
        reached.zip(wrists).map(|(reached, wrist)| norm(sub(reached, wrist))).collect()
    }

    #[test]
    fn a_bent_arm_reaches_and_other_arms_keep_their_directions() {
        let worst = |distances: Vec<f64>| distances.into_iter().fold(0.0, f64::max);
        let (down, ahead) = ([0.2, -0.9, 0.1], [-0.1, 0.1, 0.9]);
        assert!(worst(distances(down, ahead, METRES)) < 1e-6);
        // The forearm of a nearly straight arm points to the wrist, but its elbow does not move.
        assert!((0.001..0.012).contains(&worst(distances(down, [0.22, -0.9, 0.1], METRES))));
        // The rig has other bones.
        assert!(worst(distances(down, ahead, [0.16, 0.32, 0.25])) > 0.009);
    }
}
