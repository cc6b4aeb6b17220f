//! Readers of captured motion as takes for rendered persons, one for each kind of file. All are y up and at rest face
//! +z, except for TED Expressive, whose camera axes are converted.

use super::take::{CapturedFrame, CapturedTake, oriented};
use crate::mocap::upper_body::{CMU_38, T_POSE_FRAMES, named_joints};
use anyhow::{Context, Result};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, cross, scale, sub};
use orator_base::types::skeleton::{L_HAND, R_HAND, Side};
use orator_base::types::time::FrameRate;
use orator_formats::bvh::read::{Bvh, Positions};
use orator_formats::bvh::skeleton::BvhSkeleton;
use orator_formats::mocap::smplx::body;
use orator_formats::mocap::smplx::motion::SmplxMotion;
use orator_formats::mocap::ted;
use orator_formats::npz::Npz;
use std::path::Path;

/// Metres per unit of a BVH file.
const BVH_METRES: f64 = 0.01;
/// Top of the head among the 38 CMU joints; it is above the head joint when the head is level.
const CMU_HEAD_TOP: usize = 19;
/// Position from the eyes towards the nose, as a share of their distance, that is level with the ears of a level head.
const TED_LEVEL: f64 = 0.4;

fn middle(a: Vec3, b: Vec3) -> Vec3 {
    scale(add(a, b), 0.5)
}

/// Reads the takes of the CMU `.npz` that `is_wanted` selects by name: [T, 38, 3] each, millimetres. The yaw of the
/// head is not captured: it follows the shoulders.
///
/// # Errors
/// A file of another kind.
pub fn cmu(path: &Path, is_wanted: impl Fn(&str) -> bool) -> Result<Vec<CapturedTake>> {
    let mut npz = Npz::open(path)?;
    let fps = npz.frame_rate("fps")?;
    let mut names: Vec<String> = npz.names().iter().filter(|name| is_wanted(name)).cloned().collect();
    names.sort();
    let mut takes = Vec::new();
    for name in names {
        let joints = npz.numbers(&name, &[None, Some(38), Some(3)])?;
        let frame = |t: usize| {
            let at = |j: usize| -> Vec3 { std::array::from_fn(|k| joints[[t, j, k]] * 0.001) };
            let [_, head, arms @ .., right_hip, left_hip] = CMU_38.map(at);
            let up = sub(at(CMU_HEAD_TOP), head);
            let head = oriented(sub(arms[3], arms[0]), up);
            CapturedFrame::new(arms, middle(right_hip, left_hip), Some(sub(left_hip, right_hip)), head)
        };
        let frames: Vec<CapturedFrame> = (T_POSE_FRAMES..joints.shape()[0]).map(frame).collect();
        takes.extend(CapturedTake::continuous(&name, fps, &frames));
    }
    Ok(takes)
}

/// Converts a BVH file in centimetres. The head's axes are those that are upright in the zero pose, in which all
/// rotations are 0 and the spine is straight.
///
/// # Errors
/// A skeleton without the joints of an upper body; an implausible frame rate.
pub fn bvh(name: &str, bvh: &Bvh) -> Result<Vec<CapturedTake>> {
    let names: Vec<&str> = bvh.joints.iter().map(|joint| joint.name.as_str()).collect();
    let [neck, head, arms @ .., right_hip, left_hip] = named_joints(&names).with_context(|| name.to_owned())?;
    let fps = FrameRate::nearest(1.0 / bvh.frame_secs)
        .with_context(|| format!("invalid frame time {} s in {name}", bvh.frame_secs))?;
    let mut zero: Vec<Vec3> = Vec::with_capacity(bvh.joints.len());
    for joint in &bvh.joints {
        zero.push(joint.parent.map_or(joint.offset, |parent| add(zero[parent], joint.offset)));
    }
    let upright = oriented(sub(zero[arms[3]], zero[arms[0]]), sub(zero[head], zero[neck]));
    let first_channels = BvhSkeleton::of(bvh).first_channels();
    let chain: Vec<usize> = std::iter::successors(Some(head), |&joint| bvh.joints[joint].parent).collect();
    let turn = |channels: &[f64]| {
        let own = |&joint: &usize| bvh.joints[joint].rotation(&channels[first_channels[joint]..]);
        chain.iter().rev().filter_map(own).fold(Rotation::IDENTITY, |parent, own| parent * own)
    };
    let frame = |(channels, positions): (&[f64], Vec<Vec3>)| {
        let at = |joint: usize| scale(positions[joint], BVH_METRES);
        let hips = sub(at(left_hip), at(right_hip));
        let below = middle(at(left_hip), at(right_hip));
        CapturedFrame::new(arms.map(at), below, Some(hips), turn(channels) * upright)
    };
    let frames: Vec<CapturedFrame> = bvh.frames().zip(bvh.positions(Positions::Auto)).map(frame).collect();
    Ok(CapturedTake::continuous(name, fps, &frames))
}

/// Reads rotations of SMPL-X or SMPL-H (BEAT2), with fingers. A person's own proportions differ from those of the
/// skeleton, so that only directions are used.
///
/// # Errors
/// A file of another kind.
pub fn smplx(name: &str, path: &Path) -> Result<Vec<CapturedTake>> {
    let motion = SmplxMotion::read(path, None)?;
    let skeleton = body::skeleton(&motion.rest);
    let frame = |rotations| {
        let local = body::local(rotations);
        let at = skeleton.positions([0.0; 3], &local);
        let [right_hip, left_hip] = body::HIPS.map(|joint| at[joint]);
        let (below, hips) = (middle(right_hip, left_hip), sub(left_hip, right_hip));
        let head = skeleton.world(&local)[body::HEAD];
        let mut frame = CapturedFrame::new(body::ARMS.map(|joint| at[joint]), below, Some(hips), head);
        for (side, root) in [L_HAND, R_HAND].into_iter().enumerate() {
            body::hand_points(side).for_each(|(point, joint)| frame.joints[root + point] = at[joint]);
        }
        frame
    };
    let frames: Vec<CapturedFrame> = motion.rotations.iter().map(frame).collect();
    Ok(CapturedTake::continuous(name, motion.fps, &frames))
}

/// Reads a clip of TED Expressive: `human_joints` [T, 43, 3] and `fps`. It has no hips and no finger tips; joints 38 to
/// 42 are the nose, the right and left eye, and the right and left ear.
///
/// # Errors
/// A file of another kind.
pub fn ted(name: &str, path: &Path) -> Result<Vec<CapturedTake>> {
    let mut npz = Npz::open(path)?;
    let fps = npz.frame_rate("fps")?;
    let joints = npz.numbers("human_joints", &[None, Some(ted::N_TED), Some(3)])?;
    let frame = |t: usize| {
        let at = |j: usize| -> Vec3 { [joints[[t, j, 0]], -joints[[t, j, 1]], -joints[[t, j, 2]]] };
        let [nose, eyes, ears] = [at(38), middle(at(39), at(40)), middle(at(41), at(42))];
        let ahead = sub(add(eyes, scale(sub(nose, eyes), TED_LEVEL)), ears);
        let left = sub(at(42), at(41));
        let head = oriented(left, cross(ahead, left));
        let mut frame = CapturedFrame::new([3, 5, 7, 2, 4, 6].map(at), at(0), None, head);
        for (side, root) in [(Side::Left, L_HAND), (Side::Right, R_HAND)] {
            let points = ted::hand(side).into_iter().enumerate().skip(1);
            points.for_each(|(point, joint)| frame.joints[root + point] = joint.map_or([f64::NAN; 3], at));
        }
        frame
    };
    let frames: Vec<CapturedFrame> = (0..joints.shape()[0]).map(frame).collect();
    Ok(CapturedTake::continuous(name, fps, &frames))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array2, Array3, arr0};
    use orator_base::math::vec3::{norm, unit};
    use orator_base::types::skeleton::{L_ELBOW, L_SHOULDER, L_WRIST, NECK};

    fn assert_close(a: Vec3, b: Vec3) {
        assert!(norm(sub(a, b)) < 1e-6, "{a:?} {b:?}");
    }

    #[test]
    fn smplx_arms_and_fingers_follow_their_rotations() {
        let mut poses = Array2::<f32>::zeros((40, 165));
        // Left arm hanging, left index finger bent at its base, head turned to the left.
        poses.column_mut(3 * 16 + 2).fill(-std::f32::consts::FRAC_PI_2);
        poses.column_mut(3 * 25 + 2).fill(-std::f32::consts::FRAC_PI_2);
        poses.column_mut(3 * 15 + 1).fill(0.5);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npz");
        orator_formats::npz::write(&path, |npz| {
            npz.add_array("poses", &poses)?;
            npz.add_array("mocap_frame_rate", &arr0(30i32))
        })
        .unwrap();
        let takes = smplx("talk", &path).unwrap();
        assert_eq!((takes[0].name.as_str(), takes[0].frames.len()), ("talk#0", 40));
        let CapturedFrame { joints, spine, head, .. } = takes[0].frames[7];
        assert_close(sub(joints[L_WRIST], joints[L_SHOULDER]), [0.0, -0.53, 0.0]);
        assert_close(spine, [0.0, 1.0, 0.0]);
        assert_close(head.turn([0.0, 0.0, 1.0]), [0.5f64.sin(), 0.0, 0.5f64.cos()]);
        let bone = |joint: usize| unit(sub(joints[joint + 1], joints[joint]), 0.0).unwrap();
        // The index finger pointed down with the arm and is bent inwards; the middle finger is straight.
        assert!(bone(L_HAND + 5)[0] < -0.95 && bone(L_HAND + 9)[1] < -0.95);
        assert!(takes[0].missing_joints().is_empty());
        assert!(smplx("talk", &dir.path().join("b.npz")).is_err());
    }

    #[test]
    fn the_head_of_a_bvh_is_upright_in_any_axes() {
        // Bones along x in their own axes, which the root's rotation of 90 degrees about z turns upright.
        let joint = |name: &str, offset: &str, inside: &str| {
            format!("JOINT {name} {{ OFFSET {offset} CHANNELS 3 Zrotation Xrotation Yrotation {inside} }} ")
        };
        let arm = |side: &str, z: i32| {
            let hand = joint(&format!("Hand_{side}"), "22 0 0", "");
            let lower = joint(&format!("LowerArm_{side}"), "24 0 0", &hand);
            joint(&format!("UpperArm_{side}"), &format!("15 0 {z}"), &lower)
        };
        let neck = joint("Neck", "16 0 0", &joint("Head", "7 0 0", ""));
        let legs = joint("UpperLeg_L", "0 0 9", "") + &joint("UpperLeg_R", "0 0 -9", "");
        let spine = joint("Spine", "24 0 0", &(neck + &arm("L", 18) + &arm("R", -18)));
        // The root turns x up, y ahead and z to the left.
        let hips = "ROOT Hips { OFFSET 0 90 0 CHANNELS 3 Zrotation Xrotation Yrotation";
        let frame = "90 90 0 ".to_owned() + &"0 0 0 ".repeat(11);
        let text =
            format!("HIERARCHY {hips} {spine} {legs} }} MOTION Frames: 40 Frame Time: 0.0333333 {}", frame.repeat(40));
        let takes = bvh("a", &Bvh::parse(&text).unwrap()).unwrap();
        assert_eq!(takes[0].fps, FrameRate::new(30, 1));
        let frame = takes[0].frames[3];
        assert_close(frame.shoulder_line(), [0.36, 0.0, 0.0]);
        assert_close(frame.spine, [0.0, 1.0, 0.0]);
        assert_close(frame.head.turn([0.0, 0.0, 1.0]), [0.0, 0.0, 1.0]);
        assert_close(frame.head.turn([0.0, 1.0, 0.0]), [0.0, 1.0, 0.0]);
        assert_eq!(takes[0].missing_joints().len(), 40);
    }

    #[test]
    fn cmu_and_ted_arrays_are_converted_to_the_axes_of_rigs() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npz");
        let cmu_joints = Array3::from_shape_fn((80, 38, 3), |(_, j, k)| {
            let side = if [21, 22, 23, 2].contains(&j) { 1.0 } else { -1.0 };
            let x = match j {
                30 | 21 => 200.0,
                31 | 22 => 500.0,
                32 | 23 => 740.0,
                8 | 2 => 100.0,
                _ => 0.0,
            };
            [side * x, if x > 100.0 { 400.0 } else { 10.0 * j as f32 }, 0.0][k]
        });
        let ted_joints = Array3::from_shape_fn((20, 43, 3), |(_, j, k)| {
            let at = match j {
                0 => [0.0, 0.26, 0.0],
                2 => [0.22, 0.0, 0.0],
                3 => [-0.22, 0.0, 0.0],
                4 => [0.22, 0.36, 0.0],
                5 => [-0.22, 0.36, 0.0],
                6 => [0.22, 0.36, -0.33],
                7 => [-0.22, 0.36, -0.33],
                38 => [0.0, -0.15, -0.2],
                39 | 40 => [if j == 39 { -0.07 } else { 0.07 }, -0.25, -0.13],
                41 | 42 => [if j == 41 { -0.12 } else { 0.12 }, -0.21, 0.0],
                _ => [0.0, 0.36, -0.01 * j as f32],
            };
            at[k]
        });
        orator_formats::npz::write(&path, |npz| {
            npz.add_array("walk", &cmu_joints)?;
            npz.add_array("human_joints", &ted_joints)?;
            npz.add_array("fps", &arr0(15f32))
        })
        .unwrap();
        let takes = cmu(&path, |name| name == "walk").unwrap();
        assert_eq!((takes.len(), takes[0].frames.len()), (1, 79));
        let frame = takes[0].frames[0];
        assert_close(frame.joints[L_ELBOW], [0.5, 0.4, 0.0]);
        assert_close(frame.joints[NECK], [0.0, 0.4, 0.0]);
        assert!(frame.head.angle() < 1e-6 && frame.hips.is_some_and(|hips| (hips[0] - 0.2).abs() < 1e-6), "{frame:?}");
        let takes = ted("speaker", &path).unwrap();
        let frame = takes[0].frames[0];
        assert_close(sub(frame.joints[L_WRIST], frame.joints[L_ELBOW]), [0.0, 0.0, 0.33]);
        assert!(frame.head.angle() < 0.01 && frame.hips.is_none() && frame.spine[1] > 0.999, "{frame:?}");
        let tips = [L_HAND, R_HAND].into_iter().flat_map(|root| [4, 8, 12, 16, 20].map(|tip| root + tip));
        assert_eq!(takes[0].missing_joints(), tips.collect::<Vec<_>>());
    }
}
