//! Rotations of our rig as rotations of a user's skeleton. Its rest pose may be another: each of its bones is first turned,
//! by the smallest rotation, to the direction that ours has at rest, then as ours turns in the world. The wrists are then
//! put at the places that ours have about the middle of the shoulders, scaled by the length of the arms.

use super::bone_map::BoneMap;
use super::reach::reach;
use super::user_rig::{Placed, UserRig};
use crate::animate::rig::rig::Rig;
use anyhow::{Context as _, Result, ensure};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, across, add, cross, dot, norm, scale, sub, unit};
use orator_formats::bvh::write::BvhClip;

/// Cosine of the angle to an axis of the file below which a skeleton faces along the axis.
const ALONG_AXIS: f64 = 0.9;

/// Length of a bone beyond which a file holds no skeleton, in its unit.
const LONGEST: f64 = 1e9;
/// Cosine of the angle between the upward ways of two poses that stand alike.
const UPRIGHT: f64 = 0.7;

/// A joint of the user's skeleton with the joint of ours that moves it.
#[derive(Clone, Copy, Debug)]
struct Moved {
    ours: usize,
    /// Its world rotation where ours has none.
    rest: Rotation,
}

/// Poses in which the bones of both skeletons are compared.
#[derive(Clone, Copy, Debug)]
struct ComparedPoses<'a> {
    t_pose: &'a [Vec3],
    rest: &'a [Placed],
    /// From our axes to those of the file.
    axes: Rotation,
    /// Whether the user's is its rest pose.
    is_pose: bool,
}

/// Joints of an arm in the user's skeleton and in ours: arm, forearm, hand.
#[derive(Clone, Copy, Debug)]
struct ArmPair {
    theirs: [usize; 3],
    ours: [usize; 3],
    lengths: [f64; 2],
}

/// Motion of our rig on a user's skeleton.
#[derive(Clone, Debug)]
pub struct Transfer<'a> {
    user: &'a UserRig,
    /// From our axes to the world of the user's file.
    axes: Rotation,
    moved: Vec<Option<Moved>>,
    /// Local rotations of joints that nothing moves.
    still: Vec<Rotation>,
    arms: [ArmPair; 2],
    /// Length of its arms over that of ours.
    scale: f64,
}

impl<'a> Transfer<'a> {
    /// Prepares the transfer from `rig` by a map. Errors: a skeleton whose arms have no length, or whose left and right
    /// are at one place.
    pub fn new(rig: &Rig, user: &'a UserRig, map: &BoneMap) -> Result<Self> {
        let ours = &rig.skeleton;
        let t_pose = ours.positions(rig.root, &vec![Rotation::IDENTITY; ours.joints.len()]);
        let lost = "no left and right, or no up and down, at rest";
        let (rest, standing) = (user.at_rest(), user.standing());
        let at_rest = facing(&rest, map);
        let stands = facing(&standing, map).or(at_rest).context(lost)?;
        // A zero pose that does not stand as the figure does is no pose of a body: then the standing pose is the reference.
        let at_rest = at_rest.filter(|axes| dot(axes.axes()[1], stands.axes()[1]) > UPRIGHT);
        let is_pose = at_rest.is_some();
        let (rest, axes) = at_rest.map_or_else(|| (standing, upright(stands)), |axes| (rest, axes));
        let reference = ComparedPoses { t_pose: &t_pose, rest: &rest, axes, is_pose };
        let mut moved = vec![None; user.joints.len()];
        for (n, bone) in ours.joints.iter().enumerate() {
            let Some(joint) = map.joint(&bone.name).filter(|_| !bone.end) else { continue };
            let turned = rest_turn(rig, n, map, reference).unwrap_or(Rotation::IDENTITY);
            moved[joint] = Some(Moved { ours: n, rest: turned * axes.inverse() * rest[joint].turn });
        }
        let still = user.joints.iter().enumerate().map(|(n, joint)| match joint.parent {
            Some(parent) => rest[parent].turn.inverse() * rest[n].turn,
            None => rest[n].turn,
        });
        let still = still.collect();
        let pair = |side: &str| -> Result<ArmPair> {
            let names = ["Arm", "ForeArm", "Hand"].map(|bone| format!("{side}{bone}"));
            let found = |name: &String| map.joint(name).zip(ours.find(name));
            let [a, b, c] = names.each_ref().map(found);
            let (a, b, c) = a.zip(b).zip(c).map(|((a, b), c)| (a, b, c)).context("an arm is not whole")?;
            let length = |from: usize, to: usize| norm(sub(rest[to].place, rest[from].place));
            let lengths = [length(a.0, b.0), length(b.0, c.0)];
            ensure!(
                lengths.iter().all(|&length| length > 1e-9 && length < LONGEST),
                "the {side} arm has no length at rest"
            );
            Ok(ArmPair { theirs: [a.0, b.0, c.0], ours: [a.1, b.1, c.1], lengths })
        };
        let arms = [pair("Left")?, pair("Right")?];
        let own = |arm: &ArmPair| norm(ours.joints[arm.ours[1]].offset) + norm(ours.joints[arm.ours[2]].offset);
        let theirs: f64 = arms.iter().map(|arm| arm.lengths[0] + arm.lengths[1]).sum();
        let scale = theirs / arms.iter().map(own).sum::<f64>().max(1e-9);
        Ok(Self { user, axes, moved, still, arms, scale })
    }

    /// Local rotations of the user's joints in a frame of our clip.
    pub fn frame(&self, clip: &BvhClip, frame: usize) -> Vec<Rotation> {
        let world = clip.skeleton.world(&clip.local[frame]);
        let positions = clip.positions(frame);
        let mut arms: Vec<(usize, Rotation)> = Vec::new();
        let turned = |arms: &[(usize, Rotation)], joint: usize, parent: Rotation| {
            let reaching = arms.iter().find(|(at, _)| *at == joint).map(|(_, turn)| *turn);
            let moved = || self.moved[joint].map(|moved| self.axes * world[moved.ours] * moved.rest);
            reaching.or_else(moved).unwrap_or_else(|| parent * self.still[joint])
        };
        let placed = self.user.placed(|joint, parent| turned(&arms, joint, parent));
        let middle = |places: [Vec3; 2]| scale(add(places[0], places[1]), 0.5);
        let from = middle(self.arms.map(|arm| positions[arm.ours[0]]));
        let to = middle(self.arms.map(|arm| placed[arm.theirs[0]].place));
        for arm in &self.arms {
            let wrist = sub(positions[arm.ours[2]], from);
            let goal = add(to, scale(self.axes.turn(wrist), self.scale));
            let [shoulder, elbow, hand] = arm.theirs.map(|joint| placed[joint].place);
            let [new_elbow, new_hand] = reach(shoulder, elbow, goal, arm.lengths);
            let ways = [(elbow, shoulder, new_elbow, shoulder), (hand, elbow, new_hand, new_elbow)];
            for (joint, (end, start, new_end, new_start)) in arm.theirs.into_iter().zip(ways) {
                let ways = unit(sub(end, start), 1e-9).zip(unit(sub(new_end, new_start), 1e-9));
                let turn = ways.map_or(Rotation::IDENTITY, |(way, new)| Rotation::between(way, new));
                arms.push((joint, turn * placed[joint].turn));
            }
        }
        let placed = self.user.placed(|joint, parent| turned(&arms, joint, parent));
        let local = |(joint, at): (usize, &Placed)| {
            let parent = self.user.joints[joint].parent.map_or(Rotation::IDENTITY, |parent| placed[parent].turn);
            parent.inverse() * at.turn
        };
        placed.iter().enumerate().map(local).collect()
    }

    /// Whether a joint is moved.
    pub fn moves(&self, joint: usize) -> bool {
        self.moved[joint].is_some()
    }
}

/// Axes in which the skeleton stands at rest: x to its left, y up, z ahead, in the axes of the file; along them where they
/// nearly are.
fn facing(rest: &[Placed], map: &BoneMap) -> Option<Rotation> {
    let place = |own: &str| map.joint(own).map(|joint| rest[joint].place);
    let [left, right] = [place("LeftArm")?, place("RightArm")?];
    let x = unit(sub(left, right), 1e-9)?;
    let top = place("Neck").unwrap_or_else(|| scale(add(left, right), 0.5));
    let y = unit(across(sub(top, place("Hips")?), x), 1e-9)?;
    let snapped = |way: Vec3| {
        let axis = nearest_axis(way);
        (dot(axis, way) > ALONG_AXIS).then_some(axis)
    };
    let (x, y) = snapped(x).zip(snapped(y)).filter(|(x, y)| dot(*x, *y) == 0.0).unwrap_or((x, y));
    Some(Rotation::from_axes(x, y, cross(x, y)))
}

/// Axes with y along that axis of the file to which it is nearest, for figures that stoop.
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

/// Rotation, in our axes, of a bone of theirs from its direction at rest to that of ours. Hands turn their palm too.
fn rest_turn(rig: &Rig, joint: usize, map: &BoneMap, reference: ComparedPoses) -> Option<Rotation> {
    let ComparedPoses { t_pose, rest, axes, is_pose } = reference;
    let ours = &rig.skeleton;
    let way = |from: usize, to: usize| -> Option<(Vec3, Vec3)> {
        let pair = |n: usize| map.joint(&ours.joints[n].name).map(|theirs| (t_pose[n], rest[theirs].place));
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
            // A hand without fingers goes on as its forearm does.
            (along, _) => match along {
                Some((own, other)) => Some(Rotation::between(other, own)),
                None => rest_turn(rig, ours.joints[joint].parent?, map, reference),
            },
        };
    }
    // The trunk of a rest pose is upright, though its joints may lie on a curve.
    if is_pose && ["Hips", "Spine", "Chest", "Neck", "Head"].contains(&name) {
        return None;
    }
    let child = ours.children(joint).find(|&child| !ours.joints[child].end);
    match child.and_then(|child| way(joint, child)) {
        Some((own, other)) => Some(Rotation::between(other, own)),
        // The last bone of a finger and the foot go on as the bone before them.
        None => rest_turn(rig, ours.joints[joint].parent?, map, reference),
    }
}
