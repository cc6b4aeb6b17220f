//! A user's skeleton at rest, in its own axes and unit, with forward kinematics.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, scale};

/// A joint of a user's skeleton.
#[derive(Clone, Debug, PartialEq)]
pub struct UserJoint {
    pub name: String,
    /// Index of the parent, smaller than the joint's own.
    pub parent: Option<usize>,
    /// From the parent, in the parent's axes and unit.
    pub offset: Vec3,
    /// Local rotation at rest.
    pub rest: Rotation,
    /// Factor of everything below it, relative to its parent.
    pub scale: f64,
    /// Whether motion may be put on it (the end of a bone, a camera or a mesh is none).
    pub moves: bool,
}

/// Where a joint is in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    pub turn: Rotation,
    pub place: Vec3,
    /// Factor from the joint's unit to the world's.
    pub scale: f64,
}

/// A user's skeleton, parents before their children.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UserRig {
    pub joints: Vec<UserJoint>,
    /// Local rotations of a pose in which the figure stands in the file's world: a zero pose may lie in it. Empty: the rest
    /// pose.
    pub standing: Vec<Rotation>,
}

impl UserRig {
    /// Places of the joints; `turn(joint, parent)` is a joint's world rotation, given its parent's.
    pub fn placed(&self, turn: impl Fn(usize, Rotation) -> Rotation) -> Vec<Placed> {
        let mut placed: Vec<Placed> = Vec::with_capacity(self.joints.len());
        for (n, joint) in self.joints.iter().enumerate() {
            let none = Placed { turn: Rotation::IDENTITY, place: [0.0; 3], scale: 1.0 };
            let parent = joint.parent.map_or(none, |parent| placed[parent]);
            placed.push(Placed {
                turn: turn(n, parent.turn),
                place: add(parent.place, scale(parent.turn.turn(joint.offset), parent.scale)),
                scale: parent.scale * joint.scale,
            });
        }
        placed
    }

    /// Places of the joints at rest.
    pub fn at_rest(&self) -> Vec<Placed> {
        self.placed(|joint, parent| parent * self.joints[joint].rest)
    }

    /// Places of the joints of the standing figure.
    pub fn standing(&self) -> Vec<Placed> {
        if self.standing.is_empty() {
            self.at_rest()
        } else {
            self.placed(|joint, parent| parent * self.standing[joint])
        }
    }

    /// Places of all joints for local rotations.
    pub fn positions(&self, local: &[Rotation]) -> Vec<Vec3> {
        self.placed(|joint, parent| parent * local[joint]).into_iter().map(|placed| placed.place).collect()
    }

    /// Whether `joint` hangs, over any number of joints, on `above`.
    pub fn is_below(&self, joint: usize, above: usize) -> bool {
        std::iter::successors(self.joints[joint].parent, |&at| self.joints[at].parent).any(|at| at == above)
    }
}
