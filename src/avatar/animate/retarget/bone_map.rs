//! Mapping between our bones and the joints of a user's skeleton, found by name or structure, assigned by the file
//! (VRM), or read from an editable text with one line `LeftArm = "upperarm_l"` per bone.

use super::user_rig::{JointTransform, UserRig};
use anyhow::{Context as _, Result, bail, ensure};
use orator_base::motion::fk::Skeleton;
use orator_base::text::counted;
use orator_formats::skeleton::matched::{MatchJoint, MatchedJoints};
use std::collections::{BTreeMap, BTreeSet};

/// Bones that a skeleton must have to receive a gesture.
pub const REQUIRED: [&str; 7] = ["Hips", "LeftArm", "LeftForeArm", "LeftHand", "RightArm", "RightForeArm", "RightHand"];
/// Maximum number of names that an error lists.
const MAX_LISTED: usize = 60;

/// Joints of a user's skeleton, by the names of our bones.
#[derive(Clone, Debug, PartialEq)]
pub struct BoneMap {
    joints: BTreeMap<String, usize>,
    /// Bones that were found by the structure of the skeleton instead of a name.
    by_structure: BTreeSet<String>,
}

impl BoneMap {
    /// The complete map of [`Self::draft`].
    ///
    /// # Errors
    /// Those of [`Self::check`].
    pub fn detect(rig: &UserRig) -> Result<Self> {
        let map = Self::draft(rig);
        map.check(rig)?;
        Ok(map)
    }

    /// Finds the joints as far as possible; the chest is the joint that carries both arms and the neck.
    pub fn draft(rig: &UserRig) -> Self {
        let positions = rig.standing_pose();
        let joint = |(n, at): (usize, &JointTransform)| MatchJoint {
            name: &rig.joints[n].name,
            parent: rig.joints[n].parent,
            position: at.position,
            moves: rig.joints[n].moves,
        };
        let named: Vec<MatchJoint> = positions.iter().enumerate().map(joint).collect();
        let matched = match rig.humanoid.is_empty() {
            true => MatchedJoints::by_name(&named, &REQUIRED),
            false => MatchedJoints::with_named(rig.humanoid.clone(), &named, &REQUIRED),
        };
        let MatchedJoints { mut joints, by_structure } = matched;
        if let Some(chest) = chest(rig, &joints) {
            joints.insert("Chest".to_owned(), chest);
        }
        Self { joints, by_structure }
    }

    /// Parses the text of a map.
    ///
    /// # Errors
    /// The text is not TOML, or names a bone or joint that does not exist; those of [`Self::check`].
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
        let map = Self { joints, by_structure: BTreeSet::new() };
        map.check(rig)?;
        Ok(map)
    }

    /// Text of the map in the order of our bones; bones without a joint are commented out, and joints without a bone
    /// are listed if a required bone is missing.
    pub fn text(&self, rig: &UserRig, ours: &Skeleton) -> String {
        let line = |own: &str| match self.joint(own) {
            Some(joint) if self.by_structure.contains(own) => {
                format!("{own} = {:?} # found by structure, not by name\n", rig.joints[joint].name)
            }
            Some(joint) => format!("{own} = {:?}\n", rig.joints[joint].name),
            None => format!("# {own} = \"\"\n"),
        };
        let head = "# Bone of orator = joint of your skeleton that it moves. Bones without a line move no joint.\n";
        let bones = ours.joints.iter().filter(|joint| !joint.end).map(|joint| line(&joint.name));
        let mut text = head.to_owned() + &bones.collect::<String>();
        if !self.missing().is_empty() {
            let is_free = |n: &usize| rig.joints[*n].moves && !self.joints.values().any(|joint| joint == n);
            let free = (0..rig.joints.len()).filter(is_free).map(|n| format!("{:?}", rig.joints[n].name));
            text += &format!("# Joints without a bone: {}\n", free.collect::<Vec<_>>().join(" "));
        }
        text
    }

    /// Joint of the user's skeleton for one of our bones.
    pub fn joint(&self, own: &str) -> Option<usize> {
        self.joints.get(own).copied()
    }

    /// Assumptions made when matching the joints, one sentence each.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if !self.by_structure.is_empty() {
            notes.push(format!(
                "{} found by the structure of the skeleton, since the names are unknown: check the bone map",
                counted(self.by_structure.len(), "bone")
            ));
        }
        if self.joint("Neck").is_none() {
            notes.push("the skeleton has no neck: the middle of the shoulders takes its position".to_owned());
        }
        notes
    }

    /// Checks that the required bones have joints whose transforms can be used.
    ///
    /// # Errors
    /// Hips, an arm, a forearm or a hand has no joint, the joints of an arm are not descendants of each other, or a
    /// mapped joint or its ancestor is sheared or has a scale that is not uniform and positive.
    pub fn check(&self, rig: &UserRig) -> Result<()> {
        let missing = self.missing();
        if !missing.is_empty() {
            bail!(
                "no joint found for {}; {}; --write-bone-map FILE writes a draft to edit and pass to --bone-map",
                missing.join(", "),
                listed(rig)
            );
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
        for &joint in self.joints.values() {
            if let Some(error) = rig.path(joint).find_map(|at| rig.joints[at].scale_error.as_ref()) {
                bail!("{error}");
            }
        }
        Ok(())
    }

    /// Required bones without a joint.
    fn missing(&self) -> Vec<&'static str> {
        REQUIRED.into_iter().filter(|own| !self.joints.contains_key(*own)).collect()
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
