//! Our bones and a skeleton's corresponding joints, by name and, where required bones have no known name, by structure.

use super::joint_names;
use super::structure::match_structure;
use orator_base::math::vec3::Vec3;
use std::collections::{BTreeMap, BTreeSet};

/// A joint to be matched; parents precede their children.
#[derive(Clone, Copy, Debug)]
pub struct MatchJoint<'a> {
    pub name: &'a str,
    pub parent: Option<usize>,
    /// Position in an upright pose, in any unit.
    pub position: Vec3,
    /// Whether the joint may be animated; false for ends of bones.
    pub moves: bool,
}

/// Joints by the names of our bones, of which the chest is never matched.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MatchedJoints {
    pub joints: BTreeMap<String, usize>,
    /// Bones that were found by the structure of the skeleton instead of a name.
    pub by_structure: BTreeSet<String>,
}

impl MatchedJoints {
    /// Matches joints by name, and those of the missing bones by structure if a required bone is missing.
    pub fn by_name(joints: &[MatchJoint], required: &[&str]) -> Self {
        let names: Vec<&str> = joints.iter().map(|joint| if joint.moves { joint.name } else { "" }).collect();
        Self::with_named(joint_names::match_names(&names), joints, required)
    }

    /// Adds missing bones to the joints of `named` by structure if a required bone is missing.
    pub fn with_named(named: BTreeMap<String, usize>, joints: &[MatchJoint], required: &[&str]) -> Self {
        let mut matched = Self { joints: named, by_structure: BTreeSet::new() };
        if required.iter().any(|own| !matched.joints.contains_key(*own)) {
            let taken: BTreeSet<usize> = matched.joints.values().copied().collect();
            for (own, joint) in match_structure(joints, &matched.joints) {
                if !matched.joints.contains_key(&own) && !taken.contains(&joint) {
                    matched.by_structure.insert(own.clone());
                    matched.joints.insert(own, joint);
                }
            }
        }
        matched
    }
}
