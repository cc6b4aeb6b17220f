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
pub fn without_numbers<'a>(names: &[&'a str]) -> Vec<&'a str> {
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
