//! Bone names in files: our own, Mixamo's, Unity's humanoid, VRM 1.0, Unreal's. Additional bones of a convention are in
//! `file_skeleton`.

use orator_base::motion::fk::Skeleton;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Names {
    /// `Hips`, `LeftForeArm`, `LeftHandIndex1`: Mixamo's names without prefix, and `Chest`.
    #[default]
    Own,
    /// `mixamorig:Hips` and so on; our chest is `Spine1`.
    Mixamo,
    /// Unity's `HumanBodyBones`.
    UnityHumanoid,
    /// Humanoid bones of VRM 1.0 (`VRMC_vrm`).
    Vrm,
    /// Unreal's Manny and MetaHumans; our chest is `spine_05`, and `spine_02` to `spine_04` and `neck_02` are absent.
    Unreal,
}

impl Names {
    pub const ALL: [Self; 5] = [Self::Own, Self::Mixamo, Self::UnityHumanoid, Self::Vrm, Self::Unreal];

    /// Name on the command line.
    pub fn label(self) -> &'static str {
        match self {
            Self::Own => "own",
            Self::Mixamo => "mixamo",
            Self::UnityHumanoid => "unity-humanoid",
            Self::Vrm => "vrm",
            Self::Unreal => "unreal",
        }
    }

    /// Names of all joints of a skeleton, including bone ends (a finger's fourth, `HeadEnd`, `LeftFootEnd`).
    pub fn of(self, skeleton: &Skeleton) -> Vec<String> {
        let own = |joint: usize| -> String {
            let bone = &skeleton.joints[joint];
            match bone.parent.map(|parent| skeleton.joints[parent].name.as_str()) {
                Some(before) if bone.end => match before.strip_suffix('3') {
                    Some(finger) => format!("{finger}4"),
                    None => format!("{before}End"),
                },
                _ => bone.name.clone(),
            }
        };
        (0..skeleton.joints.len()).map(|joint| self.translated(&own(joint))).collect()
    }

    fn translated(self, own: &str) -> String {
        match self {
            Self::Own => own.to_owned(),
            Self::Mixamo => {
                let name = match own {
                    "Chest" => "Spine1".to_owned(),
                    "HeadEnd" => "HeadTop_End".to_owned(),
                    _ => own.replace("ToeBaseEnd", "Toe_End").replace("FootEnd", "ToeBase"),
                };
                format!("mixamorig:{name}")
            }
            Self::Unreal => unreal(own),
            Self::UnityHumanoid => humanoid(own, ["Proximal", "Intermediate", "Distal"]),
            Self::Vrm => {
                let name = humanoid(own, ["Metacarpal", "Proximal", "Distal"]);
                let mut letters = name.chars();
                letters.next().map(|first| first.to_lowercase().chain(letters).collect()).unwrap_or_default()
            }
        }
    }
}

fn unreal(own: &str) -> String {
    let (part, side) = match (own.strip_prefix("Left"), own.strip_prefix("Right")) {
        (Some(part), _) => (part, "_l"),
        (_, Some(part)) => (part, "_r"),
        _ => (own, ""),
    };
    let name = match part {
        "Hips" => "pelvis",
        "Spine" => "spine_01",
        "Chest" => "spine_05",
        "Neck" => "neck_01",
        "Head" => "head",
        "HeadEnd" => "head_end",
        "Shoulder" => "clavicle",
        "Arm" => "upperarm",
        "ForeArm" => "lowerarm",
        "Hand" => "hand",
        "UpLeg" => "thigh",
        "Leg" => "calf",
        "Foot" => "foot",
        "FootEnd" => "ball",
        _ => "",
    };
    let finger = part.strip_prefix("Hand").and_then(|finger| finger.split_at_checked(finger.len().saturating_sub(1)));
    match (name, finger) {
        ("", Some((finger, digit))) => format!("{}_0{digit}{side}", finger.to_lowercase()),
        ("", None) => own.to_owned(),
        _ => format!("{name}{side}"),
    }
}

/// Name in Unity's convention; `thumb` names the thumb's bones from base to tip.
fn humanoid(own: &str, thumb: [&str; 3]) -> String {
    let Some((side, part)) = ["Left", "Right"].iter().find_map(|side| Some((*side, own.strip_prefix(side)?))) else {
        return own.to_owned();
    };
    let part = match part {
        "Arm" => "UpperArm".to_owned(),
        "ForeArm" => "LowerArm".to_owned(),
        "UpLeg" => "UpperLeg".to_owned(),
        "Leg" => "LowerLeg".to_owned(),
        _ => match part.strip_prefix("Hand").and_then(|finger| finger.split_at_checked(finger.len().saturating_sub(1)))
        {
            Some((finger, digit)) if !finger.is_empty() => {
                let bones = if finger == "Thumb" { thumb } else { ["Proximal", "Intermediate", "Distal"] };
                let bone = ["1", "2", "3"].iter().position(|known| *known == digit).map_or("Tip", |k| bones[k]);
                format!("{}{bone}", if finger == "Pinky" { "Little" } else { finger })
            }
            _ => part.to_owned(),
        },
    };
    format!("{side}{part}")
}
