//! Mapping between our bones and the joints of a user's skeleton, found by name or read from an editable text with one
//! line `LeftArm = "upperarm_l"` per bone.

use super::bone_names;
use super::user_rig::UserRig;
use anyhow::{Context as _, Result, bail, ensure};
use orator_base::motion::fk::Skeleton;
use std::collections::BTreeMap;

/// Bones that a skeleton must have to receive a gesture.
const REQUIRED: [&str; 7] = ["Hips", "LeftArm", "LeftForeArm", "LeftHand", "RightArm", "RightForeArm", "RightHand"];
/// Maximum number of names that an error lists.
const MAX_LISTED: usize = 60;

/// Joints of a user's skeleton, by the names of our bones.
#[derive(Clone, Debug, PartialEq)]
pub struct BoneMap {
    joints: BTreeMap<String, usize>,
}

impl BoneMap {
    /// Finds the joints by name; the chest is the joint that carries both arms and the neck.
    ///
    /// # Errors
    /// No joint name matches the hips, an arm, forearm or hand.
    pub fn detect(rig: &UserRig) -> Result<Self> {
        // Empty names exclude joints that cannot move.
        let names: Vec<&str> =
            rig.joints.iter().map(|joint| if joint.moves { joint.name.as_str() } else { "" }).collect();
        let mut joints: BTreeMap<String, usize> = bone_names::match_names(&names).into_iter().collect();
        if let Some(chest) = chest(rig, &joints) {
            joints.insert("Chest".to_owned(), chest);
        }
        Self { joints }.checked(rig)
    }

    /// Parses the text of a map.
    ///
    /// # Errors
    /// The text is not TOML, names a bone or joint that does not exist, or lacks a required bone.
    pub fn parse(text: &str, rig: &UserRig, ours: &Skeleton) -> Result<Self> {
        let table: BTreeMap<String, String> =
            toml::from_str(text).context("expected lines like LeftArm = \"upperarm_l\"")?;
        let mut joints = BTreeMap::new();
        for (own, name) in table {
            ensure!(
                ours.joints.iter().any(|joint| !joint.end && joint.name == own),
                "unknown bone {own}: `--write-bone-map` writes a map with all bone names"
            );
            let found = rig.joints.iter().position(|joint| joint.moves && joint.name == name);
            let joint = found.with_context(|| format!("{own}: the skeleton has no joint {name}; {}", listed(rig)))?;
            joints.insert(own, joint);
        }
        Self { joints }.checked(rig)
    }

    /// Text of the map in the order of our bones; bones without a joint are commented out.
    pub fn text(&self, rig: &UserRig, ours: &Skeleton) -> String {
        let line = |own: &str| match self.joint(own) {
            Some(joint) => format!("{own} = {:?}\n", rig.joints[joint].name),
            None => format!("# {own} = \"\"\n"),
        };
        let head = "# Bone of orator = joint of your skeleton that it moves. Bones without a line move no joint.\n";
        let bones = ours.joints.iter().filter(|joint| !joint.end).map(|joint| line(&joint.name));
        head.to_owned() + &bones.collect::<String>()
    }

    /// Joint of the user's skeleton for one of our bones.
    pub fn joint(&self, own: &str) -> Option<usize> {
        self.joints.get(own).copied()
    }

    /// Number of bones that have a joint.
    pub fn n_bones(&self) -> usize {
        self.joints.len()
    }

    fn checked(self, rig: &UserRig) -> Result<Self> {
        let missing: Vec<&str> = REQUIRED.into_iter().filter(|own| !self.joints.contains_key(*own)).collect();
        if !missing.is_empty() {
            bail!("no joint found for {}; {}; map them with --bone-map", missing.join(", "), listed(rig));
        }
        for side in ["Left", "Right"] {
            for (above, below) in [("Arm", "ForeArm"), ("ForeArm", "Hand")] {
                let [above, below] = [above, below].map(|bone| self.joints[&format!("{side}{bone}")]);
                let [a, b] = [above, below].map(|joint| &rig.joints[joint].name);
                ensure!(
                    rig.is_below(below, above),
                    "{b} is not a descendant of {a}: map the joints of the arm with --bone-map"
                );
            }
        }
        Ok(self)
    }
}

/// The lowest joint that carries both arms and the neck, unless it is the spine or the hips.
fn chest(rig: &UserRig, joints: &BTreeMap<String, usize>) -> Option<usize> {
    let carried: Vec<usize> =
        ["LeftArm", "RightArm", "Neck"].iter().filter_map(|own| joints.get(*own).copied()).collect();
    let carries = |at: usize| carried.iter().all(|&joint| rig.is_below(joint, at));
    let lowest = (0..rig.joints.len()).rev().find(|&at| rig.joints[at].moves && carries(at))?;
    let is_taken = joints.values().any(|&joint| joint == lowest);
    let is_on_trunk = joints.get("Hips").is_some_and(|&hips| rig.is_below(lowest, hips));
    (!is_taken && is_on_trunk).then_some(lowest)
}

fn listed(rig: &UserRig) -> String {
    let names: Vec<&str> = rig.joints.iter().filter(|joint| joint.moves).map(|joint| joint.name.as_str()).collect();
    format!("available joints: {}", names[..names.len().min(MAX_LISTED)].join(" "))
}
