//! Converts rotations of our rig to rotations of a user's skeleton, with another rest pose. Each of its bones is first
//! aligned, by the smallest rotation, with the rest direction of ours and then follows our world rotation. Two-bone
//! inverse kinematics puts the wrists at our positions relative to the shoulders' centre, scaled by arm length.

use super::bone_map::BoneMap;
use super::two_bone::solve_two_bone;
use super::user_rig::{JointTransform, UserRig};
use crate::animate::rig::rig::Rig;
use anyhow::{Context as _, Result, ensure};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, across, add, cross, dot, norm, scale, sub, unit};
use orator_formats::bvh::write::BvhClip;

/// Minimum cosine of the angle to an axis of the file at which a skeleton is taken to face along that axis.
const MIN_AXIS_COS: f64 = 0.9;

/// Maximum length of a bone, in the unit of the file.
const MAX_BONE_LENGTH: f64 = 1e9;
/// Minimum cosine between the up directions of two poses that count as equally upright.
const MIN_UPRIGHT_COS: f64 = 0.7;

/// A joint of the user's skeleton that one of our joints moves.
#[derive(Clone, Copy, Debug)]
struct DrivenJoint {
    ours: usize,
    /// Its world rotation when ours is the identity.
    rest: Rotation,
}

/// Poses in which the bones of both skeletons are compared.
#[derive(Clone, Copy, Debug)]
struct ComparedPoses<'a> {
    t_pose: &'a [Vec3],
    rest: &'a [JointTransform],
    /// From our axes to those of the file.
    axes: Rotation,
    /// Whether `rest` is the user's rest pose; otherwise it is the standing pose.
    is_rest_pose: bool,
}

/// Joints of an arm in the user's skeleton and in ours: upper arm, forearm, hand.
#[derive(Clone, Copy, Debug)]
struct ArmPair {
    theirs: [usize; 3],
    ours: [usize; 3],
    lengths: [f64; 2],
}

/// Retargeting of our rig to a user's skeleton.
#[derive(Clone, Debug)]
pub struct Transfer<'a> {
    user: &'a UserRig,
    /// From our axes to the world axes of the user's file.
    axes: Rotation,
    moved: Vec<Option<DrivenJoint>>,
    /// Local rotations of joints that are not moved.
    undriven: Vec<Rotation>,
    arms: [ArmPair; 2],
    /// Length of the user's arms relative to ours.
    scale: f64,
}

impl<'a> Transfer<'a> {
    /// Prepares the retargeting from `rig` with a bone map.
    ///
    /// # Errors
    /// Arms have no length, or left and right or up and down cannot be determined.
    pub fn new(rig: &Rig, user: &'a UserRig, map: &BoneMap) -> Result<Self> {
        let ours = &rig.skeleton;
        let t_pose = ours.positions(rig.root, &vec![Rotation::IDENTITY; ours.joints.len()]);
        let ReferencePose { joints: rest, axes, is_rest_pose } = ReferencePose::of(user, map)?;
        let reference = ComparedPoses { t_pose: &t_pose, rest: &rest, axes, is_rest_pose };
        let mut moved = vec![None; user.joints.len()];
        for (n, bone) in ours.joints.iter().enumerate() {
            let Some(joint) = map.joint(&bone.name).filter(|_| !bone.end) else { continue };
            let turned = rest_turn(rig, n, map, reference).unwrap_or(Rotation::IDENTITY);
            moved[joint] = Some(DrivenJoint { ours: n, rest: turned * axes.inverse() * rest[joint].turn });
        }
        let undriven = user.joints.iter().enumerate().map(|(n, joint)| match joint.parent {
            Some(parent) => rest[parent].turn.inverse() * rest[n].turn,
            None => rest[n].turn,
        });
        let undriven = undriven.collect();
        let pair = |side: &str| -> Result<ArmPair> {
            let names = ["Arm", "ForeArm", "Hand"].map(|bone| format!("{side}{bone}"));
            let found = |name: &String| map.joint(name).zip(ours.find(name));
            let [a, b, c] = names.each_ref().map(found);
            let (a, b, c) = a.zip(b).zip(c).map(|((a, b), c)| (a, b, c)).context("an arm has missing bones")?;
            let length = |from: usize, to: usize| norm(sub(rest[to].position, rest[from].position));
            let lengths = [length(a.0, b.0), length(b.0, c.0)];
            ensure!(
                lengths.iter().all(|&length| length > 1e-9 && length < MAX_BONE_LENGTH),
                "the {side} arm has an invalid length in the rest pose"
            );
            Ok(ArmPair { theirs: [a.0, b.0, c.0], ours: [a.1, b.1, c.1], lengths })
        };
        let arms = [pair("Left")?, pair("Right")?];
        let own = |arm: &ArmPair| norm(ours.joints[arm.ours[1]].offset) + norm(ours.joints[arm.ours[2]].offset);
        let theirs: f64 = arms.iter().map(|arm| arm.lengths[0] + arm.lengths[1]).sum();
        let scale = theirs / arms.iter().map(own).sum::<f64>().max(1e-9);
        Ok(Self { user, axes, moved, undriven, arms, scale })
    }

    /// Local rotations of the user's joints for a frame of our clip.
    pub fn frame(&self, clip: &BvhClip, frame: usize) -> Vec<Rotation> {
        let world = clip.skeleton.world(&clip.local[frame]);
        let positions = clip.positions(frame);
        let mut arms: Vec<(usize, Rotation)> = Vec::new();
        let turned = |arms: &[(usize, Rotation)], joint: usize, parent: Rotation| {
            let reaching = arms.iter().find(|(at, _)| *at == joint).map(|(_, turn)| *turn);
            let moved = || self.moved[joint].map(|moved| self.axes * world[moved.ours] * moved.rest);
            reaching.or_else(moved).unwrap_or_else(|| parent * self.undriven[joint])
        };
        let placed = self.user.placed(|joint, parent| turned(&arms, joint, parent));
        let middle = |places: [Vec3; 2]| scale(add(places[0], places[1]), 0.5);
        let from = middle(self.arms.map(|arm| positions[arm.ours[0]]));
        let to = middle(self.arms.map(|arm| placed[arm.theirs[0]].position));
        for arm in &self.arms {
            let wrist = sub(positions[arm.ours[2]], from);
            let goal = add(to, scale(self.axes.turn(wrist), self.scale));
            let [shoulder, elbow, hand] = arm.theirs.map(|joint| placed[joint].position);
            let [new_elbow, new_hand] = solve_two_bone(shoulder, elbow, goal, arm.lengths);
            let ways = [(elbow, shoulder, new_elbow, shoulder), (hand, elbow, new_hand, new_elbow)];
            for (joint, (end, start, new_end, new_start)) in arm.theirs.into_iter().zip(ways) {
                let ways = unit(sub(end, start), 1e-9).zip(unit(sub(new_end, new_start), 1e-9));
                let turn = ways.map_or(Rotation::IDENTITY, |(way, new)| Rotation::between(way, new));
                arms.push((joint, turn * placed[joint].turn));
            }
        }
        let placed = self.user.placed(|joint, parent| turned(&arms, joint, parent));
        let local = |(joint, at): (usize, &JointTransform)| {
            let parent = self.user.joints[joint].parent.map_or(Rotation::IDENTITY, |parent| placed[parent].turn);
            parent.inverse() * at.turn
        };
        placed.iter().enumerate().map(local).collect()
    }

    pub fn moves(&self, joint: usize) -> bool {
        self.moved[joint].is_some()
    }
}

/// Pose of a user's skeleton that corresponds to our rest pose.
pub struct ReferencePose {
    pub joints: Vec<JointTransform>,
    /// From our axes to those of the file.
    pub axes: Rotation,
    /// Whether it is the user's rest pose; otherwise it is the standing pose.
    pub is_rest_pose: bool,
}

impl ReferencePose {
    /// The rest pose, or the standing pose if the rest pose is not upright like it.
    ///
    /// # Errors
    /// Left and right or up and down cannot be determined.
    pub fn of(user: &UserRig, map: &BoneMap) -> Result<Self> {
        let (rest, standing) = (user.at_rest(), user.standing_pose());
        let at_rest = facing(&rest, map);
        let undetermined = "cannot determine left, right, up and down in the rest pose";
        let standing_axes = facing(&standing, map).or(at_rest).context(undetermined)?;
        let at_rest = at_rest.filter(|axes| dot(axes.axes()[1], standing_axes.axes()[1]) > MIN_UPRIGHT_COS);
        Ok(match at_rest {
            Some(axes) => Self { joints: rest, axes, is_rest_pose: true },
            None => Self { joints: standing, axes: upright(standing_axes), is_rest_pose: false },
        })
    }
}

/// Axes of the skeleton at rest, in those of the file: x to its left, y up, z forward. They are snapped to the axes of
/// the file if nearly parallel.
fn facing(rest: &[JointTransform], map: &BoneMap) -> Option<Rotation> {
    let place = |own: &str| map.joint(own).map(|joint| rest[joint].position);
    let [left, right] = [place("LeftArm")?, place("RightArm")?];
    let x = unit(sub(left, right), 1e-9)?;
    let top = place("Neck").unwrap_or_else(|| scale(add(left, right), 0.5));
    let y = unit(across(sub(top, place("Hips")?), x), 1e-9)?;
    let snapped = |way: Vec3| {
        let axis = nearest_axis(way);
        (dot(axis, way) > MIN_AXIS_COS).then_some(axis)
    };
    let (x, y) = snapped(x).zip(snapped(y)).filter(|(x, y)| dot(*x, *y) == 0.0).unwrap_or((x, y));
    Some(Rotation::from_axes(x, y, cross(x, y)))
}

/// Replaces y by the nearest axis of the file, for skeletons in a stooping pose.
fn upright(axes: Rotation) -> Rotation {
    let [x, y, _] = axes.axes();
    let y = nearest_axis(y);
    unit(across(x, y), 1e-6).map_or(axes, |x| Rotation::from_axes(x, y, cross(x, y)))
}

fn nearest_axis(way: Vec3) -> Vec3 {
    let axis = (0..3).max_by(|&a, &b| way[a].abs().total_cmp(&way[b].abs())).unwrap_or(1);
    let mut unit = [0.0; 3];
    unit[axis] = way[axis].signum();
    unit
}

/// Rotation, in our axes, that aligns the rest direction of a user's bone with ours. Hands also align their palm.
fn rest_turn(rig: &Rig, joint: usize, map: &BoneMap, reference: ComparedPoses) -> Option<Rotation> {
    let ComparedPoses { t_pose, rest, axes, is_rest_pose } = reference;
    let ours = &rig.skeleton;
    let way = |from: usize, to: usize| -> Option<(Vec3, Vec3)> {
        let pair = |n: usize| map.joint(&ours.joints[n].name).map(|theirs| (t_pose[n], rest[theirs].position));
        let ((a, c), (b, d)) = (pair(from)?, pair(to)?);
        unit(sub(b, a), 1e-9).zip(unit(axes.inverse().turn(sub(d, c)), 1e-9))
    };
    let name = ours.joints[joint].name.as_str();
    if let Some(side) = name.strip_suffix("Hand") {
        let finger = |finger: &str| ours.find(&format!("{side}Hand{finger}1"));
        let knuckles = finger("Index").zip(finger("Pinky")).and_then(|(a, b)| way(a, b));
        let along = finger("Middle").and_then(|middle| way(joint, middle));
        return match (along, knuckles) {
            (Some(along), Some(knuckles)) => {
                let frame = |along: Vec3, over: Vec3| Some((along, unit(across(over, along), 1e-6)?));
                Some(Rotation::between_frames(frame(along.1, knuckles.1)?, frame(along.0, knuckles.0)?))
            }
            // A hand without fingers is aligned like its forearm.
            (along, _) => match along {
                Some((own, other)) => Some(Rotation::between(other, own)),
                None => rest_turn(rig, ours.joints[joint].parent?, map, reference),
            },
        };
    }
    // A user's skeleton is at rest when the captured one is.
    if let Some(turn) = rig.rest.get(&joint).filter(|_| is_rest_pose) {
        return Some(turn.inverse());
    }
    // The trunk of a rest pose is upright even if its joints lie on a curve.
    if is_rest_pose && ["Hips", "Spine", "Chest", "Neck", "Head"].contains(&name) {
        return None;
    }
    let child = ours.children(joint).find(|&child| !ours.joints[child].end);
    match child.and_then(|child| way(joint, child)) {
        Some((own, other)) => Some(Rotation::between(other, own)),
        // The last bone of a finger and the foot are aligned like the preceding bone.
        None => rest_turn(rig, ours.joints[joint].parent?, map, reference),
    }
}
