//! Bone names of common skeletons: ours, Mixamo, Unity, VRM, Unreal, Rigify, Character Creator, Biped, Daz, SMPL, CMU,
//! Bandai-Namco. Names are compared after the normalisation of `formats::bvh::joint_names`.

use orator_formats::bvh::joint_names::plain;

const TRUNK: [(&str, &[&str]); 4] = [
    ("Hips", &["hips", "pelvis", "hip", "cog", "root"]),
    ("Spine", &["spine", "spine1", "spine01", "spine001", "waist", "abdomen", "abdomenlower", "lowerback", "torso"]),
    ("Neck", &["neck", "neck01", "neck1", "neck0", "necktwist01", "lowerneck", "neck001", "necklower"]),
    ("Head", &["head"]),
];
const SIDED: [(&str, &[&str]); 7] = [
    ("Shoulder", &["clavicle", "collar", "collarbone", "shoulder"]),
    ("Arm", &["upperarm", "uparm", "humerus", "arm", "shldr", "shldrbend", "shoulder"]),
    ("ForeArm", &["forearm", "lowerarm", "lowarm", "forearmbend", "radius", "elbow"]),
    ("Hand", &["hand", "wrist"]),
    ("UpLeg", &["upleg", "upperleg", "thigh", "thighbend", "femur", "hip"]),
    ("Leg", &["leg", "lowerleg", "lowleg", "calf", "shin", "tibia", "knee"]),
    ("Foot", &["foot", "ankle"]),
];
/// Rigify numbers the trunk under a single name from the hips to the head.
const RIGIFY: [(&str, &str); 4] =
    [("Hips", "spine"), ("Spine", "spine001"), ("Neck", "spine004"), ("Head", "spine006")];
const FINGERS: [(&str, &[&str]); 5] = [
    ("Thumb", &["thumb"]),
    ("Index", &["index", "point"]),
    ("Middle", &["middle", "mid"]),
    ("Ring", &["ring"]),
    ("Pinky", &["pinky", "little", "pink"]),
];
const BONES: [&str; 3] = ["proximal", "intermediate", "distal"];

/// For each of our joints except the chest, the index of the name that matches it.
pub fn match_names(names: &[&str]) -> Vec<(String, usize)> {
    let plain: Vec<String> = names.iter().map(|name| plain(name)).collect();
    let at = |wanted: &str| plain.iter().position(|name| name == wanted);
    let mut found = Vec::new();
    let is_rigify = at("spine006").is_some() && at("hips").is_none();
    for (own, stems) in TRUNK {
        let rigify = RIGIFY.iter().find(|(name, _)| *name == own).filter(|_| is_rigify);
        let joint = match rigify {
            Some((_, name)) => at(name),
            None => stems.iter().find_map(|stem| at(stem)),
        };
        found.extend(joint.map(|joint| (own.to_owned(), joint)));
    }
    for (side, words) in [("Left", ["left", "l"]), ("Right", ["right", "r"])] {
        let sided = |stem: &str| {
            words.iter().flat_map(|w| [format!("{w}{stem}"), format!("{stem}{w}")]).find_map(|name| at(&name))
        };
        let limb = |stems: &[&str]| stems.iter().find_map(|stem| sided(stem));
        let arm = limb(SIDED[1].1);
        for (own, stems) in SIDED {
            // A shoulder that is also the joint of the upper arm is not a clavicle.
            let joint = limb(stems).filter(|joint| own != "Shoulder" || Some(*joint) != arm);
            found.extend(joint.map(|joint| (format!("{side}{own}"), joint)));
        }
        // The thumb starts with a metacarpal bone in VRM and with a proximal bone in Unity.
        let is_vrm = sided("thumbmetacarpal").is_some();
        for (own, stems) in FINGERS {
            let bones = if is_vrm && own == "Thumb" { ["metacarpal", "proximal", "distal"] } else { BONES };
            for (k, bone) in bones.into_iter().enumerate() {
                let joint = stems.iter().flat_map(|stem| spellings(stem, k + 1, bone)).find_map(|stem| sided(&stem));
                found.extend(joint.map(|joint| (format!("{side}Hand{own}{}", k + 1), joint)));
            }
        }
    }
    found
}

/// Spellings of a finger bone without its side.
fn spellings(stem: &str, k: usize, bone: &str) -> [String; 7] {
    [
        format!("hand{stem}{k}"),
        format!("{stem}{k}"),
        format!("{stem}0{k}"),
        format!("f{stem}0{k}"),
        format!("{stem}{bone}"),
        format!("hand{stem}0{k}"),
        format!("finger{stem}{k}"),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::animate::rig::names::Names;
    use crate::animate::rig::rig::tests::default_rig;

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
    fn skeletons_of_other_programs_are_matched() {
        for (names, n) in [
            (
                "root pelvis spine_01 spine_02 spine_03 clavicle_l upperarm_l lowerarm_l hand_l index_01_l thumb_03_l \
                 neck_01 head thigh_l calf_l foot_l",
                13,
            ),
            (
                "DEF-spine DEF-spine.001 DEF-spine.002 DEF-spine.003 DEF-spine.004 DEF-spine.006 DEF-shoulder.L \
                 DEF-upper_arm.L DEF-forearm.L DEF-hand.L DEF-f_index.01.L DEF-thumb.02.L DEF-thigh.L DEF-shin.L \
                 DEF-foot.L",
                13,
            ),
            ("Hips Spine Chest Neck Head Shoulder_L UpperArm_L LowerArm_L Hand_L UpperLeg_L LowerLeg_L Foot_L", 11),
            (
                "root lowerback upperback thorax lowerneck head lclavicle lhumerus lradius lwrist lfemur ltibia lfoot",
                11,
            ),
            (
                "pelvis spine1 neck head left_collar left_shoulder left_elbow left_wrist left_hip left_knee left_ankle",
                11,
            ),
            ("hip abdomen neck head lShldr lForeArm lHand lThigh lShin lFoot", 10),
        ] {
            let names: Vec<&str> = names.split_whitespace().collect();
            let found = match_names(&names);
            assert_eq!(found.len(), n, "{found:?} of {names:?}");
            let of = |own: &str| found.iter().find(|(name, _)| name == own).map(|(_, joint)| names[*joint]);
            assert!(of("LeftArm").is_some() && of("LeftArm") != of("LeftShoulder"), "{found:?}");
            assert!(of("LeftUpLeg").is_some() && of("LeftUpLeg") != of("Hips"), "{found:?}");
        }
    }
}
