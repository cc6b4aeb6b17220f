//! Tests of `orator_avatar::animate::retarget::bone_map`.

use crate::animate::unit::file_skeleton::default_rig;
use orator_avatar::animate::retarget::bone_map::{BoneMap, REQUIRED};
use orator_avatar::animate::retarget::user_rig::{UserJoint, UserRig};
use orator_avatar::animate::rig::names::Names;
use orator_base::math::rotation::Rotation;
use orator_base::motion::fk::Skeleton;
use orator_formats::skeleton::joint_names::match_names;

/// Our skeleton at rest with other names of the joints.
fn renamed(rename: impl Fn(&str) -> String) -> (UserRig, Skeleton) {
    let ours = default_rig().skeleton;
    let joint = |(n, joint): (usize, &orator_base::motion::fk::Joint)| UserJoint {
        name: if joint.end { format!("end{n}") } else { rename(&joint.name) },
        parent: joint.parent,
        offset: joint.offset,
        rest: Rotation::IDENTITY,
        scale: 1.0,
        scale_error: None,
        moves: !joint.end,
    };
    (UserRig { joints: ours.joints.iter().enumerate().map(joint).collect(), ..UserRig::default() }, ours)
}

#[test]
fn every_naming_convention_is_matched_completely() {
    let rig = default_rig().skeleton;
    for names in Names::ALL {
        let file_names = names.of(&rig);
        let file_names: Vec<&str> = file_names.iter().map(String::as_str).collect();
        let found = match_names(&file_names);
        let expected = rig.joints.iter().filter(|joint| !joint.end && joint.name != "Chest").count();
        assert_eq!(found.len(), expected, "{names:?}");
        for (own, joint) in found {
            assert_eq!(rig.joints[joint].name, own, "{names:?}");
        }
    }
}

#[test]
fn a_draft_of_unknown_names_marks_what_the_structure_shows() {
    let (rig, ours) = renamed(|_| "joint".to_owned());
    let map = BoneMap::detect(&rig).unwrap();
    for own in REQUIRED.into_iter().chain(["Spine", "Chest", "Neck", "Head", "LeftShoulder", "RightUpLeg", "LeftFoot"])
    {
        assert_eq!(map.joint(own), ours.find(own), "{own}");
    }
    let text = map.text(&rig, &ours);
    assert!(text.contains("# found by structure") && !text.contains("Joints without"), "{text}");
    assert!(map.notes()[0].contains("by the structure"), "{:?}", map.notes());
}

#[test]
fn a_draft_without_a_required_bone_lists_the_joints() {
    let (mut rig, ours) = renamed(|name| name.replace("RightForeArm", "Crank"));
    // Arms of different lengths have no common structure.
    rig.joints[ours.find("RightForeArm").unwrap()].offset = [-90.0, 0.0, 0.0];
    let map = BoneMap::draft(&rig);
    let text = map.text(&rig, &ours);
    assert!(
        text.contains("# RightForeArm = \"\"\n") && text.contains("# Joints without a bone: \"Crank\"\n"),
        "{text}"
    );
    let error = BoneMap::detect(&rig).unwrap_err().to_string();
    assert!(error.contains("no joint found for RightForeArm") && error.contains("--write-bone-map"), "{error}");
    let edited = text.replace("# RightForeArm = \"\"", "RightForeArm = \"Crank\"");
    assert_eq!(BoneMap::parse(&edited, &rig, &ours).unwrap().joint("RightForeArm"), ours.find("RightForeArm"));
}

#[test]
fn a_scale_counts_only_on_mapped_joints_and_their_ancestors() {
    let (mut rig, ours) = renamed(|name| name.replace("Head", "Crown"));
    rig.joints[ours.find("Head").unwrap()].scale_error = Some("scale 1, 2, 1 of Crown".to_owned());
    BoneMap::detect(&rig).unwrap();
    rig.joints[ours.find("LeftShoulder").unwrap()].scale_error = Some("scale 1, 2, 1 of LeftShoulder".to_owned());
    let error = BoneMap::detect(&rig).unwrap_err().to_string();
    assert!(error.contains("of LeftShoulder"), "{error}");
    let (rig, _) = renamed(|name| name.replace("Neck", "Pole"));
    assert!(BoneMap::detect(&rig).unwrap().notes()[0].contains("the middle of the shoulders"));
}
