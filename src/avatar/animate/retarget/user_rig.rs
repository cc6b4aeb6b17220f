//! A user's skeleton at rest, in its own axes and unit, with forward kinematics.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, scale};
use std::collections::BTreeMap;

#[derive(Clone, Debug, PartialEq)]
pub struct UserJoint {
    pub name: String,
    /// Index of the parent, smaller than the joint's own.
    pub parent: Option<usize>,
    /// Offset from the parent, in the parent's axes and unit.
    pub offset: Vec3,
    /// Local rotation at rest.
    pub rest: Rotation,
    /// Scale factor of the joint's descendants, relative to its parent.
    pub scale: f64,
    /// Why the transform of the joint cannot be used, if its scale is not uniform and positive.
    pub scale_error: Option<String>,
    /// Whether the joint may be animated; false for bone ends, cameras and meshes.
    pub moves: bool,
}

/// World transform of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointTransform {
    pub turn: Rotation,
    pub position: Vec3,
    /// Scale factor from the joint's unit to the world's.
    pub scale: f64,
}

/// A user's skeleton, with parents before their children.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UserRig {
    pub joints: Vec<UserJoint>,
    /// Local rotations of a pose upright in the file's world, since a zero pose may lie down. Empty: the rest pose.
    pub standing_pose: Vec<Rotation>,
    /// Joints that the file itself assigns to our bones; empty to match them by name.
    pub humanoid: BTreeMap<String, usize>,
}

impl UserRig {
    /// World transforms of the joints; `turn(joint, parent)` returns a joint's world rotation, given its parent's.
    pub fn placed(&self, turn: impl Fn(usize, Rotation) -> Rotation) -> Vec<JointTransform> {
        let mut placed: Vec<JointTransform> = Vec::with_capacity(self.joints.len());
        for (n, joint) in self.joints.iter().enumerate() {
            let none = JointTransform { turn: Rotation::IDENTITY, position: [0.0; 3], scale: 1.0 };
            let parent = joint.parent.map_or(none, |parent| placed[parent]);
            placed.push(JointTransform {
                turn: turn(n, parent.turn),
                position: add(parent.position, scale(parent.turn.turn(joint.offset), parent.scale)),
                scale: parent.scale * joint.scale,
            });
        }
        placed
    }

    /// World transforms of the joints at rest.
    pub fn at_rest(&self) -> Vec<JointTransform> {
        self.placed(|joint, parent| parent * self.joints[joint].rest)
    }

    /// World transforms of the joints in the standing pose.
    pub fn standing_pose(&self) -> Vec<JointTransform> {
        if self.standing_pose.is_empty() {
            self.at_rest()
        } else {
            self.placed(|joint, parent| parent * self.standing_pose[joint])
        }
    }

    /// World positions of all joints for local rotations.
    pub fn positions(&self, local: &[Rotation]) -> Vec<Vec3> {
        self.placed(|joint, parent| parent * local[joint]).into_iter().map(|placed| placed.position).collect()
    }

    /// Whether `joint` is a descendant of `above`.
    pub fn is_below(&self, joint: usize, above: usize) -> bool {
        self.path(joint).skip(1).any(|at| at == above)
    }

    /// A joint and its ancestors.
    pub fn path(&self, joint: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(joint), |&at| self.joints[at].parent)
    }
}
