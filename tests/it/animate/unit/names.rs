//! Unit tests of `orator_avatar::animate::rig::names`.

use super::file_skeleton::default_rig;
use orator_avatar::animate::rig::file_skeleton::{FileSkeleton, RestAxes};
use orator_avatar::animate::rig::names::Names;
use std::collections::BTreeSet;

const FINGERS: [&str; 5] = ["Thumb", "Index", "Middle", "Ring", "Little"];

#[test]
fn unreal_names_end_with_the_side() {
    let called = Names::Unreal.of(&default_rig().skeleton);
    let trunk = "pelvis spine_01 spine_05 neck_01 head".split(' ').map(String::from);
    let limbs = ["clavicle", "upperarm", "lowerarm", "hand", "thigh", "calf", "foot", "ball"].map(String::from);
    let fingers = ["thumb", "index", "middle", "ring", "pinky"];
    let fingers = fingers.iter().flat_map(|finger| (1..=3).map(move |k| format!("{finger}_0{k}")));
    let parts: Vec<String> = limbs.into_iter().chain(fingers).collect();
    let both = ["l", "r"].into_iter().flat_map(|side| parts.iter().map(move |part| format!("{part}_{side}")));
    for name in trunk.chain(both) {
        assert_eq!(called.iter().filter(|known| **known == name).count(), 1, "{name}");
    }
    assert_eq!(called.iter().collect::<BTreeSet<_>>().len(), called.len());
}

#[test]
fn every_convention_has_all_its_bones() {
    let limbs = ["UpperLeg", "LowerLeg", "Foot", "Shoulder", "UpperArm", "LowerArm", "Hand"];
    let bones = ["Proximal", "Intermediate", "Distal"];
    let thumb = ["ThumbMetacarpal", "ThumbProximal", "ThumbDistal"].map(String::from);
    let fingers = |names: &[&str]| names.iter().flat_map(|f| bones.map(|b| format!("{f}{b}"))).collect::<Vec<_>>();
    let mixamo = ["UpLeg", "Leg", "Foot", "ToeBase", "Toe_End", "Shoulder", "Arm", "ForeArm", "Hand"];
    let mixamos_fingers = ["Thumb", "Index", "Middle", "Ring", "Pinky"];
    let mixamos_fingers = mixamos_fingers.iter().flat_map(|f| (1..=4).map(move |k| format!("Hand{f}{k}")));
    let mixamos_trunk = "Hips Spine Spine1 Spine2 Neck Head HeadTop_End";
    let vrms_fingers = [&thumb[..], &fingers(&FINGERS[1..])].concat();
    for (names, n, start, trunk, limbs, fingers) in [
        // `HumanBodyBones` without optional ones for which we have no joint: eyes, jaw, toes, UpperChest.
        (Names::UnityHumanoid, 49, "", "Hips Spine Chest Neck Head", &limbs[..], fingers(&FINGERS)),
        // Bones of VRM 1.0 (humanoid.md) without the optional upperChest, eyes, jaw and toes.
        (Names::Vrm, 49, "", "hips spine chest neck head", &limbs[..], vrms_fingers),
        // Skeleton of X Bot and Y Bot.
        (Names::Mixamo, 65, "mixamorig:", mixamos_trunk, &mixamo[..], mixamos_fingers.collect()),
    ] {
        let sides = if names == Names::Vrm { ["left", "right"] } else { ["Left", "Right"] };
        let all = FileSkeleton::new(&default_rig().skeleton, names, RestAxes::World).skeleton.joints;
        let called: BTreeSet<&String> = all.iter().map(|joint| &joint.name).collect();
        assert_eq!(called.len(), all.len(), "a name is given twice");
        let parts: Vec<String> = limbs.iter().map(ToString::to_string).chain(fingers).collect();
        let both = sides.iter().flat_map(|side| parts.iter().map(move |part| format!("{side}{part}")));
        let expected: Vec<String> = trunk.split(' ').map(String::from).chain(both).collect();
        let expected = expected.into_iter().map(|name| format!("{start}{name}"));
        let missing: Vec<String> = expected.clone().filter(|name| !called.contains(name)).collect();
        assert_eq!((expected.len(), missing), (n, vec![]), "{names:?}");
    }
}
