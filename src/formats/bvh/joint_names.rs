//! Joint names of BVH files, which differ between studios, exporters and datasets. Names are compared without prefix,
//! case and separators, so `mixamorig:LeftForeArm`, `CC_Base_L_Forearm`, `LowerArm_L` and `left_elbow` are all the
//! left elbow.

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

/// Prefixes that all joint names of a skeleton share.
const PREFIXES: [&str; 6] = ["ccbase", "bip001", "bip01", "valvebiped", "def", "b"];

const NECK: &[&str] = &["necktwist01", "neck", "neck0", "neck1", "lowerneck", "neck01", "upperneck"];
const HEAD: &[&str] = &["head"];
/// Names of the shoulder joint proper; `shoulder` often names the collar bone, so it comes last.
const SHOULDER: &[&str] = &["upperarm", "uparm", "humerus", "arm", "shldr", "shoulder"];
const ELBOW: &[&str] = &["forearm", "lowerarm", "lowarm", "radius", "elbow"];
const WRIST: &[&str] = &["wrist", "hand"];
const HIP: &[&str] = &["upleg", "upperleg", "thigh", "femur", "hip", "leg"];

/// Index of the name for each of the ten [`ROLES`]; `None` if no name matches.
pub fn find(names: &[&str]) -> [Option<usize>; 10] {
    let plain: Vec<String> = names.iter().map(|name| plain(name)).collect();
    let find = |stems: &[&str], side: Option<[&str; 2]>| {
        stems.iter().find_map(|stem| {
            let spellings = match side {
                None => vec![(*stem).to_owned()],
                Some(words) => words.iter().flat_map(|w| [format!("{w}{stem}"), format!("{stem}{w}")]).collect(),
            };
            plain.iter().position(|name| spellings.contains(name))
        })
    };
    let (right, left) = (Some(["right", "r"]), Some(["left", "l"]));
    [
        find(NECK, None),
        find(HEAD, None),
        find(SHOULDER, right),
        find(ELBOW, right),
        find(WRIST, right),
        find(SHOULDER, left),
        find(ELBOW, left),
        find(WRIST, left),
        find(HIP, right),
        find(HIP, left),
    ]
}

/// Normalised name: lower case, without the skeleton's prefix and without separators.
pub fn plain(name: &str) -> String {
    let name = name.rsplit([':', '|']).next().unwrap_or(name);
    let lower = name.to_ascii_lowercase();
    // A prefix counts only if a separator follows it, as `b` starts many names.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joint_names_of_common_rigs_are_recognised() {
        let kinds = [
            "Hips Spine Spine1 Neck Neck1 Head LeftShoulder LeftArm LeftForeArm LeftHand LeftHandThumb1 RightShoulder \
             RightArm RightForeArm RightHand LeftUpLeg LeftLeg RightUpLeg RightLeg",
            "mixamorig:Hips mixamorig:Neck mixamorig:Head mixamorig:LeftArm mixamorig:LeftForeArm mixamorig:LeftHand \
             mixamorig:RightArm mixamorig:RightForeArm mixamorig:RightHand mixamorig:LeftUpLeg mixamorig:RightUpLeg",
            "CC_Base_NeckTwist01 CC_Base_Head CC_Base_R_Upperarm CC_Base_R_Forearm CC_Base_R_Hand CC_Base_L_Upperarm \
             CC_Base_L_Forearm CC_Base_L_Hand CC_Base_R_Thigh CC_Base_L_Thigh",
            "Neck Head Shoulder_R UpperArm_R LowerArm_R Hand_R Shoulder_L UpperArm_L LowerArm_L Hand_L UpperLeg_R \
             UpperLeg_L",
            "pelvis neck head left_collar left_shoulder left_elbow left_wrist right_collar right_shoulder right_elbow \
             right_wrist left_hip right_hip",
            "b_root b_neck0 b_head b_l_shoulder b_l_arm b_l_forearm b_l_wrist b_r_shoulder b_r_arm b_r_forearm \
             b_r_wrist b_l_upleg b_r_upleg",
            "lowerneck head lhumerus lradius lwrist rhumerus rradius rwrist lfemur rfemur",
            "Bip01 Bip01_Neck Bip01_Head Bip01_L_UpperArm Bip01_L_Forearm Bip01_L_Hand Bip01_R_UpperArm \
             Bip01_R_Forearm Bip01_R_Hand Bip01_L_Thigh Bip01_R_Thigh",
            "hip neck head lCollar lShldr lForeArm lHand rCollar rShldr rForeArm rHand lThigh rThigh",
        ];
        for kind in kinds {
            let names: Vec<&str> = kind.split_whitespace().collect();
            let found = find(&names).map(|j| names[j.unwrap()].to_ascii_lowercase());
            assert!(found[0].contains("neck") && found[1].contains("head"), "{found:?}");
            for (j, word) in [(2, "r"), (5, "l")] {
                assert!(!found[j].contains("collar") && !found[j].contains("leg"), "{found:?}");
                let side = plain(&found[j]);
                assert!(side.starts_with(word) || side.ends_with(word), "{found:?}");
            }
            assert!(found[2..5].iter().all(|n| !plain(n).starts_with("left")), "{found:?}");
        }
    }
}
