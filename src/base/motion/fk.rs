//! Skeletons of bones with fixed offsets, and forward kinematics: local rotations to joint positions, in f64.

use crate::math::rotation::Rotation;
use crate::math::vec3::{Vec3, add};

/// A joint of a skeleton.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    pub name: String,
    /// Index of the parent, smaller than the joint's own; `None`: the root.
    pub parent: Option<usize>,
    /// From the parent, in the parent's axes at rest.
    pub offset: Vec3,
    /// Whether the joint is the end of a bone: a position without a rotation and children (a BVH `End Site`).
    pub end: bool,
}

/// Joints, parents before their children. At rest all axes are parallel to the world's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skeleton {
    pub joints: Vec<Joint>,
}

impl Skeleton {
    /// Adds a joint and gives its index.
    pub fn push(&mut self, name: &str, parent: Option<usize>, offset: Vec3, end: bool) -> usize {
        self.joints.push(Joint { name: name.to_owned(), parent, offset, end });
        self.joints.len() - 1
    }

    /// Index of the joint of that name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// Children of a joint, in order.
    pub fn children(&self, joint: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.joints.len()).filter(move |&child| self.joints[child].parent == Some(joint))
    }

    /// World rotations from local ones, one a joint.
    pub fn world(&self, local: &[Rotation]) -> Vec<Rotation> {
        let mut world: Vec<Rotation> = Vec::with_capacity(local.len());
        for (joint, &rotation) in self.joints.iter().zip(local) {
            world.push(joint.parent.map_or(rotation, |parent| world[parent] * rotation));
        }
        world
    }

    /// Positions of all joints: `local` holds one rotation a joint (those of ends are not looked at), the root stands
    /// at `root`.
    pub fn positions(&self, root: Vec3, local: &[Rotation]) -> Vec<Vec3> {
        let world = self.world(local);
        let mut places: Vec<Vec3> = Vec::with_capacity(local.len());
        for joint in &self.joints {
            places.push(match joint.parent {
                None => root,
                Some(parent) => add(places[parent], world[parent].turn(joint.offset)),
            });
        }
        places
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec3::{norm, sub};

    #[test]
    fn a_bent_arm_stands_where_it_should() {
        let mut arm = Skeleton::default();
        let root = arm.push("Shoulder", None, [0.0; 3], false);
        let elbow = arm.push("Elbow", Some(root), [2.0, 0.0, 0.0], false);
        arm.push("Wrist", Some(elbow), [1.0, 0.0, 0.0], true);
        let quarter = Rotation::about([0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_2);
        let places = arm.positions([0.0, 0.0, 5.0], &[quarter, quarter, Rotation::IDENTITY]);
        assert!(norm(sub(places[1], [0.0, 2.0, 5.0])) < 1e-12);
        assert!(norm(sub(places[2], [-1.0, 2.0, 5.0])) < 1e-12);
        assert_eq!(arm.children(root).collect::<Vec<_>>(), [elbow]);
    }
}
