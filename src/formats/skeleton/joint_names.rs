//! Bone names of common skeletons: ours, Mixamo, Unity, VRM, VRoid, Ready Player Me, Unreal, Rigify, Character Creator,
//! MakeHuman, MotionBuilder, DeepMotion, Rokoko, Perception Neuron, Biped, Daz, SMPL-X, CMU, Bandai-Namco. Names are
//! compared without case, separators, the prefix and suffix that joints share, and the numbers that Sketchfab appends.

use std::collections::{BTreeMap, HashMap};

/// The ten joints that define the pose of an upper body.
pub const ROLES: [&str; 10] = [
    "neck",
    "head",
    "right shoulder",
    "right elbow",
    "right wrist",
    "left shoulder",
    "left elbow",
    "left wrist",
    "right hip",
    "left hip",
];
/// Our bone for each of the [`ROLES`].
pub(crate) const ROLE_BONES: [&str; 10] = [
    "Neck",
    "Head",
    "RightArm",
    "RightForeArm",
    "RightHand",
    "LeftArm",
    "LeftForeArm",
    "LeftHand",
    "RightUpLeg",
    "LeftUpLeg",
];

/// Prefixes that count only if a separator follows them, since some of them start many names.
const PREFIXES: [&str; 6] = ["ccbase", "bip001", "bip01", "valvebiped", "def", "b"];
/// Number of pairs of a prefix and a suffix that are tried.
const MAX_AFFIXES: usize = 6;

const TRUNK: [(&str, &[&str]); 4] = [
    ("Hips", &["hips", "hip", "pelvis", "cog", "root"]),
    ("Spine", &["spine", "spine1", "spine01", "spine001", "waist", "abdomen", "abdomenlower", "lowerback", "torso"]),
    ("Neck", &["neck", "neck0", "neck01", "neck1", "necktwist01", "lowerneck", "neck001", "necklower", "upperneck"]),
    ("Head", &["head", "head1"]),
];
/// `shoulder` often names the collar bone, so it is the last name of an upper arm.
const ARM: &[&str] = &["upperarm", "uparm", "humerus", "arm", "shldr", "shldrbend", "upperarm01", "shoulder"];
const UP_LEG: &[&str] = &["upleg", "upperleg", "thigh", "thighbend", "femur", "upperleg01", "hip", "leg"];
/// Of two joints of a wrist or an ankle, `wrist` and `ankle` are nearer to the trunk than `hand` and `foot`.
const SIDED: [(&str, &[&str]); 7] = [
    ("Shoulder", &["clavicle", "collar", "collarbone", "shoulder"]),
    ("Arm", ARM),
    ("ForeArm", &["forearm", "lowerarm", "lowarm", "forearmbend", "radius", "elbow", "lowerarm01"]),
    ("Hand", &["wrist", "hand"]),
    ("UpLeg", UP_LEG),
    ("Leg", &["leg", "lowerleg", "lowleg", "calf", "shin", "tibia", "knee", "lowerleg01"]),
    ("Foot", &["ankle", "foot"]),
];
/// Rigify numbers the trunk under a single name from the hips to the head.
const RIGIFY: [(&str, &str); 4] =
    [("Hips", "spine"), ("Spine", "spine001"), ("Neck", "spine004"), ("Head", "spine006")];
/// Names of each finger, thumb first.
pub(crate) const FINGERS: [(&str, &[&str]); 5] = [
    ("Thumb", &["thumb"]),
    ("Index", &["index", "point"]),
    ("Middle", &["middle", "mid"]),
    ("Ring", &["ring"]),
    ("Pinky", &["pinky", "little", "pinkie", "pink"]),
];
const PHALANGES: [&str; 3] = ["proximal", "intermediate", "distal"];
const SIDES: [(&str, [&str; 2]); 2] = [("Left", ["left", "l"]), ("Right", ["right", "r"])];
/// Names within which the prefix and the suffix of a skeleton are searched.
const TRUNK_ANCHORS: [&str; 4] = ["hips", "pelvis", "neck", "head"];
const SIDED_ANCHORS: [&str; 5] = ["arm", "upperarm", "forearm", "lowerarm", "hand"];

/// Index of the name for each of the ten [`ROLES`]; `None` if no name matches.
pub fn find(names: &[&str]) -> [Option<usize>; 10] {
    let bones = match_names(names);
    ROLE_BONES.map(|bone| bones.get(bone).copied())
}

/// Index of the name that matches each of our bones except the chest. Empty names match no bone. Of the prefixes and
/// suffixes that joints of the skeleton share, those that match most bones are removed.
pub fn match_names(names: &[&str]) -> BTreeMap<String, usize> {
    let bare = without_numbers(names);
    let mut best = BTreeMap::new();
    for names in [names, bare.as_slice()] {
        let plain: Vec<String> = names.iter().map(|name| plain(name)).collect();
        for (prefix, suffix) in affixes(&plain) {
            let found = match_plain(&plain, prefix, suffix);
            if found.len() > best.len() {
                best = found;
            }
        }
    }
    best
}

/// Normalised name: lower case, without the skeleton's prefix and without separators.
fn plain(name: &str) -> String {
    let name = name.rsplit([':', '|']).next().unwrap_or(name);
    let lower = name.to_ascii_lowercase();
    let mut parts: Vec<&str> = lower.split(['_', '-', '.', ' ']).filter(|part| !part.is_empty()).collect();
    let joined = |n: usize, parts: &[&str]| parts.iter().take(n).copied().collect::<String>();
    for n in [2, 1] {
        if parts.len() > n && PREFIXES.contains(&joined(n, &parts).as_str()) {
            parts.drain(..n);
            break;
        }
    }
    parts.concat()
}

/// Names without the numbers that Sketchfab and Fab append (`LeftArm_010`), where the result differs from all others.
fn without_numbers<'a>(names: &[&'a str]) -> Vec<&'a str> {
    let bare = |name: &'a str| {
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        if stem.len() < name.len() { stem.strip_suffix('_').unwrap_or(name) } else { name }
    };
    let plain: Vec<String> = names.iter().map(|&name| plain(bare(name))).collect();
    let mut counts: HashMap<&str, usize> = HashMap::new();
    plain.iter().for_each(|name| *counts.entry(name).or_default() += 1);
    let unique = |(&name, plain): (&&'a str, &String)| if counts[plain.as_str()] == 1 { bare(name) } else { name };
    names.iter().zip(&plain).map(unique).collect()
}

/// Sides of a bone name: `leftarm`, `armleft`, `larm`, `arml`.
fn sided(words: [&str; 2], stem: &str) -> [String; 4] {
    let [word, letter] = words;
    [format!("{word}{stem}"), format!("{stem}{word}"), format!("{letter}{stem}"), format!("{stem}{letter}")]
}

/// Pairs of a prefix and a suffix: none first, then those around the names of trunk and arms, most frequent first.
fn affixes(plain: &[String]) -> Vec<(&str, &str)> {
    let arms = SIDES.iter().flat_map(|(_, words)| SIDED_ANCHORS.iter().flat_map(move |stem| sided(*words, stem)));
    let anchors: Vec<String> = TRUNK_ANCHORS.into_iter().map(str::to_owned).chain(arms).collect();
    let mut counts: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for name in plain {
        for (before, after) in anchors.iter().filter_map(|anchor| name.split_once(anchor.as_str())) {
            *counts.entry((before, after)).or_default() += 1;
        }
    }
    counts.remove(&("", ""));
    let mut frequent: Vec<((&str, &str), usize)> = counts.into_iter().collect();
    frequent.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    std::iter::once(("", "")).chain(frequent.into_iter().map(|(pair, _)| pair).take(MAX_AFFIXES)).collect()
}

/// The match of those names that have the prefix and the suffix.
fn match_plain(plain: &[String], prefix: &str, suffix: &str) -> BTreeMap<String, usize> {
    let mut first: HashMap<&str, usize> = HashMap::new();
    for (n, name) in plain.iter().enumerate() {
        if let Some(stem) = name.strip_prefix(prefix).and_then(|rest| rest.strip_suffix(suffix)) {
            first.entry(stem).or_insert(n);
        }
    }
    let at = |wanted: &str| first.get(wanted).copied();
    // `C_Head` and `Head_M` have the marker of the centre.
    let central = |stem: &str| at(stem).or_else(|| at(&format!("c{stem}"))).or_else(|| at(&format!("{stem}m")));
    let mut found = BTreeMap::new();
    let is_rigify = at("spine006").is_some() && at("hips").is_none();
    // MakeHuman numbers the spine from the top.
    let is_makehuman = at("spine05").is_some() && at("upperarm01l").is_some();
    for (own, stems) in TRUNK {
        let rigify = RIGIFY.iter().find(|(name, _)| *name == own).filter(|_| is_rigify);
        let joint = match rigify {
            Some((_, name)) => at(name),
            None if is_makehuman && own == "Spine" => at("spine05"),
            None => stems.iter().find_map(|stem| central(stem)),
        };
        found.extend(joint.map(|joint| (own.to_owned(), joint)));
    }
    for (side, words) in SIDES {
        let named = |stem: &str| sided(words, stem).iter().find_map(|name| at(name));
        let [arm, up_leg] = [ARM, UP_LEG].map(|stems| stems.iter().find_map(|stem| named(stem)));
        for (own, stems) in SIDED {
            // A shoulder that is also the joint of the upper arm is not a clavicle; a `leg` may be an upper leg.
            let other = match own {
                "Shoulder" => arm,
                "Leg" => up_leg,
                _ => None,
            };
            let joint = stems.iter().filter_map(|stem| named(stem)).find(|joint| other != Some(*joint));
            found.extend(joint.map(|joint| (format!("{side}{own}"), joint)));
        }
        // The thumb starts with a metacarpal bone in VRM and with a proximal bone in Unity.
        let has_metacarpal = ["thumbmetacarpal", "finger1metacarpal"].iter().any(|name| named(name).is_some());
        let is_biped = named("finger0").is_some();
        for (finger, (own, stems)) in FINGERS.into_iter().enumerate() {
            let bones = if has_metacarpal && finger == 0 { ["metacarpal", "proximal", "distal"] } else { PHALANGES };
            for (k, bone) in bones.into_iter().enumerate() {
                let by_word = stems.iter().flat_map(|stem| spellings(stem, k + 1, bone));
                let mut all = by_word.chain(numbered(finger, k, bone, is_biped));
                let joint = all.find_map(|stem| named(&stem));
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

/// Spellings with the number of the finger, from the thumb: of Biped (`Finger0`, `Finger01`), or of MakeHuman
/// (`finger1-1`) and Rokoko (`Finger1Proximal`, `Finger2Medial`). `finger` and `k` count from 0.
fn numbered(finger: usize, k: usize, bone: &str, is_biped: bool) -> Vec<String> {
    if is_biped {
        return vec![format!("finger{finger}{}", ["", "1", "2"][k])];
    }
    let bone = bone.replace("intermediate", "medial");
    vec![format!("finger{}{}", finger + 1, k + 1), format!("finger{}{bone}", finger + 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names of the left side and the centre, in the order of `BONES`; a dash for a bone that a skeleton lacks.
    const BONES: &str = "Hips Spine Neck Head LeftShoulder LeftArm LeftForeArm LeftHand LeftUpLeg LeftLeg LeftFoot \
                         LeftHandThumb1 LeftHandIndex2 LeftHandPinky3";

    /// Conventions with their names of `BONES`, a line each.
    const CONVENTIONS: &str = "\
        Ready Player Me: Hips Spine Neck Head LeftShoulder LeftArm LeftForeArm LeftHand LeftUpLeg LeftLeg \
        LeftFoot LeftHandThumb1 LeftHandIndex2 LeftHandPinky3\n\
        VRM 0.x: hips spine neck head leftShoulder leftUpperArm leftLowerArm leftHand leftUpperLeg leftLowerLeg \
        leftFoot leftThumbProximal leftIndexIntermediate leftLittleDistal\n\
        VRoid: J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Neck J_Bip_C_Head J_Bip_L_Shoulder J_Bip_L_UpperArm \
        J_Bip_L_LowerArm J_Bip_L_Hand J_Bip_L_UpperLeg J_Bip_L_LowerLeg J_Bip_L_Foot J_Bip_L_Thumb1 \
        J_Bip_L_Index2 J_Bip_L_Little3\n\
        Unreal: pelvis spine_01 neck_01 head clavicle_l upperarm_l lowerarm_l hand_l thigh_l calf_l foot_l \
        thumb_01_l index_02_l pinky_03_l\n\
        Character Creator: CC_Base_Hip CC_Base_Spine01 CC_Base_NeckTwist01 CC_Base_Head CC_Base_L_Clavicle \
        CC_Base_L_Upperarm CC_Base_L_Forearm CC_Base_L_Hand CC_Base_L_Thigh CC_Base_L_Calf CC_Base_L_Foot \
        CC_Base_L_Thumb1 CC_Base_L_Index2 CC_Base_L_Pinky3\n\
        MakeHuman: root spine05 neck01 head clavicle.L upperarm01.L lowerarm01.L wrist.L upperleg01.L \
        lowerleg01.L foot.L finger1-1.L finger2-2.L finger5-3.L\n\
        Rigify, the original bones: ORG-spine ORG-spine.001 ORG-spine.004 ORG-spine.006 ORG-shoulder.L \
        ORG-upper_arm.L ORG-forearm.L ORG-hand.L ORG-thigh.L ORG-shin.L ORG-foot.L ORG-thumb.01.L \
        ORG-f_index.02.L ORG-f_pinky.03.L\n\
        MotionBuilder: Character1_Hips Character1_Spine Character1_Neck Character1_Head Character1_LeftShoulder \
        Character1_LeftArm Character1_LeftForeArm Character1_LeftHand Character1_LeftUpLeg Character1_LeftLeg \
        Character1_LeftFoot Character1_LeftHandThumb1 Character1_LeftHandIndex2 Character1_LeftHandPinky3\n\
        DeepMotion: hips_JNT spine_JNT neck_JNT head_JNT l_shoulder_JNT l_arm_JNT l_forearm_JNT l_hand_JNT \
        l_upleg_JNT l_leg_JNT l_foot_JNT l_handThumb1_JNT l_handIndex2_JNT l_handPinky3_JNT\n\
        Rokoko: Hips Spine1 Neck Head LeftShoulder LeftArm LeftForeArm LeftHand LeftThigh LeftShin LeftFoot \
        LeftFinger1Metacarpal LeftFinger2Medial LeftFinger5Distal\n\
        Perception Neuron: Robot_Hips Robot_Spine Robot_Neck Robot_Head Robot_LeftShoulder Robot_LeftArm \
        Robot_LeftForeArm Robot_LeftHand Robot_LeftUpLeg Robot_LeftLeg Robot_LeftFoot Robot_LeftHandThumb1 \
        Robot_LeftHandIndex2 Robot_LeftHandPinky3\n\
        Biped: ValveBiped.Bip01_Pelvis ValveBiped.Bip01_Spine ValveBiped.Bip01_Neck1 ValveBiped.Bip01_Head1 \
        ValveBiped.Bip01_L_Clavicle ValveBiped.Bip01_L_UpperArm ValveBiped.Bip01_L_Forearm \
        ValveBiped.Bip01_L_Hand ValveBiped.Bip01_L_Thigh ValveBiped.Bip01_L_Calf ValveBiped.Bip01_L_Foot \
        ValveBiped.Bip01_L_Finger0 ValveBiped.Bip01_L_Finger11 ValveBiped.Bip01_L_Finger42\n\
        SMPL-X: pelvis spine1 neck head left_collar left_shoulder left_elbow left_wrist left_hip left_knee \
        left_ankle left_thumb1 left_index2 left_pinky3\n\
        SMPL in Maya: m_avg_Pelvis m_avg_Spine1 m_avg_Neck m_avg_Head m_avg_L_Collar m_avg_L_Shoulder \
        m_avg_L_Elbow m_avg_L_Wrist m_avg_L_Hip m_avg_L_Knee m_avg_L_Ankle - - -\n\
        CMU: root lowerback lowerneck head lclavicle lhumerus lradius lwrist lfemur ltibia lfoot - - -\n\
        Bandai-Namco: Hips Spine Neck Head Shoulder_L UpperArm_L LowerArm_L Hand_L UpperLeg_L LowerLeg_L Foot_L \
        - - -\n\
        Daz: hip abdomen neck head lCollar lShldr lForeArm lHand lThigh lShin lFoot lThumb1 lIndex2 lPinky3\n\
        BEAT: b_root - b_neck0 b_head b_l_shoulder b_l_arm b_l_forearm b_l_wrist b_l_upleg b_l_leg b_l_foot \
        b_l_thumb1 b_l_index2 b_l_pinky3";

    #[test]
    fn every_convention_is_matched_bone_by_bone() {
        for (convention, names) in CONVENTIONS.lines().filter_map(|line| line.split_once(": ")) {
            // The first joint is one without a bone; numbers as of Sketchfab are appended in the second variant.
            let parts: Vec<&str> = names.split_whitespace().collect();
            let all: Vec<&str> =
                std::iter::once("Armature").chain(parts.iter().copied().filter(|n| *n != "-")).collect();
            let numbered: Vec<String> = all.iter().enumerate().map(|(k, name)| format!("{name}_0{k}")).collect();
            let numbered: Vec<&str> = numbered.iter().map(String::as_str).collect();
            for names in [&all, &numbered] {
                let found = match_names(names);
                for (bone, part) in BONES.split_whitespace().zip(&parts).filter(|(_, part)| **part != "-") {
                    let name = found.get(bone).map(|joint| all[*joint]);
                    assert!(name.is_some_and(|name| name == *part), "{convention}, {bone}: {name:?} in {names:?}");
                }
            }
        }
    }

    #[test]
    fn a_prefix_and_a_suffix_of_any_spelling_are_removed() {
        let stems = "Hips Spine Neck Head LeftArm LeftForeArm LeftHand RightArm RightForeArm RightHand";
        for [prefix, suffix] in [
            ["mixamorig", ""],
            ["mixamorig_", ""],
            ["Armature|", ""],
            ["The Hero 2 ", ""],
            ["", "_jnt"],
            ["rig:", "Bone"],
        ] {
            let names: Vec<String> = stems.split(' ').map(|stem| format!("{prefix}{stem}{suffix}")).collect();
            // Joints outside the mapped part have neither.
            let names: Vec<&str> = ["Camera", "Light_01"].into_iter().chain(names.iter().map(String::as_str)).collect();
            let found = match_names(&names);
            for (k, stem) in stems.split(' ').enumerate() {
                assert_eq!(found.get(stem), Some(&(k + 2)), "{prefix} {suffix}: {stem}");
            }
        }
        assert_eq!(
            find(&["Neck", "", "LeftLeg", "Tail"]),
            [Some(0), None, None, None, None, None, None, None, None, Some(2)]
        );
        assert!(match_names(&["", "Bone1", "Bone2"]).is_empty());
    }

    #[test]
    fn numbers_that_distinguish_joints_are_retained() {
        let names = ["Spine_01", "Spine_02", "Neck_03", "Head_04", "LeftHand_05", "LeftHand_06"];
        let bare = ["Spine_01", "Spine_02", "Neck", "Head", "LeftHand_05", "LeftHand_06"];
        assert_eq!(without_numbers(&names), bare);
        let wrists = ["left_wrist", "left_hand", "left_ankle", "left_foot"];
        let found = match_names(&wrists);
        assert_eq!((found["LeftHand"], found["LeftFoot"]), (0, 2), "the joint nearer to the trunk");
    }
}
