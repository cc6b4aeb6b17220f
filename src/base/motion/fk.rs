//! Skeletons of bones with fixed offsets, and forward kinematics: joint positions from local rotations, in f64.

use crate::math::rotation::Rotation;
use crate::math::vec3::{Vec3, add};

#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    pub name: String,
    /// Index of the parent, smaller than the joint's own index; `None` for the root.
    pub parent: Option<usize>,
    /// Offset from the parent, in the parent's axes in the rest pose.
    pub offset: Vec3,
    /// Whether the joint is the end of a bone: a position without a rotation or children (a BVH `End Site`).
    pub end: bool,
}

/// Joints, parents before their children. In the rest pose all axes are parallel to the world axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skeleton {
    pub joints: Vec<Joint>,
}

impl Skeleton {
    /// Adds a joint and returns its index.
    pub fn push(&mut self, name: &str, parent: Option<usize>, offset: Vec3, end: bool) -> usize {
        self.joints.push(Joint { name: name.to_owned(), parent, offset, end });
        self.joints.len() - 1
    }

    /// Returns the index of the joint with this name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// Children of a joint, in index order.
    pub fn children(&self, joint: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.joints.len()).filter(move |&child| self.joints[child].parent == Some(joint))
    }

    /// Computes world rotations from local ones, one per joint.
    pub fn world(&self, local: &[Rotation]) -> Vec<Rotation> {
        let mut world: Vec<Rotation> = Vec::with_capacity(local.len());
        for (joint, &rotation) in self.joints.iter().zip(local) {
            world.push(joint.parent.map_or(rotation, |parent| world[parent] * rotation));
        }
        world
    }

    /// Positions of all joints from one local rotation per joint (those of ends are ignored), with the root at `root`.
    pub fn positions(&self, root: Vec3, local: &[Rotation]) -> Vec<Vec3> {
        let world = self.world(local);
        let mut positions: Vec<Vec3> = Vec::with_capacity(local.len());
        for joint in &self.joints {
            positions.push(match joint.parent {
                None => root,
                Some(parent) => add(positions[parent], world[parent].turn(joint.offset)),
            });
        }
        positions
    }
}
