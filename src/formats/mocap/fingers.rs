//! Hand joints of a BVH skeleton: each finger's joints are found by name, in any convention, and ordered by hierarchy.

use crate::bvh::read::Bvh;
use crate::skeleton::joint_names::FINGERS;
use orator_base::math::vec3;
use orator_base::types::pose2d::N_HAND;
use orator_base::types::skeleton::Side;
use std::collections::BTreeMap;

/// Indices of the hand joints of one side: wrist, then thumb to little finger, each base to tip; `None` unless at
/// least two fingers share a wrist.
pub fn hand(bvh: &Bvh, side: Side) -> Option<[Option<usize>; N_HAND]> {
    let chains: Vec<Vec<usize>> = (0..5).map(|finger| chain(bvh, side, finger)).collect();
    let firsts: Vec<usize> = chains.iter().filter_map(|c| c.first().copied()).collect();
    let wrist = common_parent(bvh, &firsts)?;
    let mut joints = [None; N_HAND];
    joints[0] = Some(wrist);
    for (finger, chain) in chains.iter().enumerate() {
        let chain = &chain[usize::from(has_metacarpal(bvh, wrist, finger, chain))..];
        let bones = chain.iter().zip(0..4).take_while(|(joint, k)| *k == 0 || bone_length(bvh, **joint) > 0.0);
        bones.for_each(|(&joint, k)| joints[1 + 4 * finger + k] = Some(joint));
    }
    Some(joints)
}

/// Hand joints among the joints of our bones, for names that number the fingers; the tip is the end of the last bone.
/// `None` for fewer than two fingers.
pub(super) fn matched_hand(bvh: &Bvh, bones: &BTreeMap<String, usize>, side: Side) -> Option<[Option<usize>; N_HAND]> {
    let side = if side == Side::Left { "Left" } else { "Right" };
    let bone = |name: String| bones.get(&name).copied();
    let end_of = |last: usize| {
        (last + 1..bvh.joints.len()).find(|&n| bvh.joints[n].parent == Some(last) && bone_length(bvh, n) > 0.0)
    };
    let mut joints = [None; N_HAND];
    joints[0] = bone(format!("{side}Hand"));
    for (finger, (own, _)) in FINGERS.iter().enumerate() {
        let [first, second, third] = [1, 2, 3].map(|k| bone(format!("{side}Hand{own}{k}")));
        joints[1 + 4 * finger..][..4].copy_from_slice(&[first, second, third, third.and_then(end_of)]);
    }
    let n_fingers = (0..5).filter(|finger| joints[1 + 4 * finger].is_some()).count();
    (n_fingers > 1).then_some(joints)
}

/// Joints of a finger from its base to the end site of its last bone; empty if there are fewer than two.
fn chain(bvh: &Bvh, side: Side, finger: usize) -> Vec<usize> {
    let mut chain: Vec<usize> = Vec::new();
    for (i, joint) in bvh.joints.iter().enumerate() {
        let follows = chain.last().is_none_or(|last| joint.parent == Some(*last));
        if follows && parse_name(&joint.name) == Some((side, finger)) {
            chain.push(i);
        }
    }
    if chain.len() > 1 { chain } else { Vec::new() }
}

fn parse_name(name: &str) -> Option<(Side, usize)> {
    let words = words(name.rsplit(':').next().unwrap_or(name));
    let all = words.concat();
    if ["foot", "toe", "eye", "brow", "lip"].iter().any(|w| all.contains(w)) {
        return None;
    }
    // "lthumb" is one word: what remains without the finger name is the side.
    let (finger, rest) = words.iter().enumerate().find_map(|(i, word)| {
        FINGERS.iter().enumerate().find_map(|(finger, (_, names))| {
            let (before, after) = names.iter().find_map(|name| word.split_once(name))?;
            let ends = after.is_empty() || ["finger", "end", "tip", "l", "r", "left", "right"].contains(&after);
            let others = words.iter().enumerate().filter(|(k, _)| *k != i).map(|(_, w)| w.as_str());
            ends.then(|| (finger, [before, after].into_iter().chain(others).map(str::to_owned).collect::<Vec<_>>()))
        })
    })?;
    let has_side = |side: &str| rest.iter().any(|word| word == &side[..1] || word.contains(side));
    match (has_side("left"), has_side("right")) {
        (true, false) => Some((Side::Left, finger)),
        (false, true) => Some((Side::Right, finger)),
        _ => None,
    }
}

/// Lower-case words of a name, split at non-letters and at changes of letter case.
fn words(name: &str) -> Vec<String> {
    let letters: Vec<char> = name.chars().collect();
    let mut words = vec![String::new()];
    for (i, c) in letters.iter().enumerate() {
        let is_lower = |k: usize| letters.get(k).is_some_and(|c| c.is_lowercase());
        let starts_word = c.is_uppercase() && (i > 0 && is_lower(i - 1) || is_lower(i + 1));
        if starts_word || !c.is_alphabetic() {
            words.push(String::new());
        }
        if let (true, Some(word)) = (c.is_alphabetic(), words.last_mut()) {
            word.extend(c.to_lowercase());
        }
    }
    words.retain(|w| !w.is_empty());
    words
}

/// The deepest joint that is an ancestor of all `joints`; `None` for fewer than two joints.
fn common_parent(bvh: &Bvh, joints: &[usize]) -> Option<usize> {
    let ancestors = |joint: usize| std::iter::successors(bvh.joints[joint].parent, |&j| bvh.joints[j].parent);
    let (first, others) = joints.split_first()?;
    let is_common = |candidate: &usize| others.iter().all(|&j| ancestors(j).any(|a| a == *candidate));
    ancestors(*first).find(is_common).filter(|_| !others.is_empty())
}

fn bone_length(bvh: &Bvh, joint: usize) -> f64 {
    vec3::norm(bvh.joints[joint].offset)
}

/// Whether the first joint of a chain is a metacarpal joint in the palm instead of the knuckle. Fingers: it is nearer
/// to the wrist than to the next joint. Thumb: the chain has one joint more than a thumb, numbered from 0.
fn has_metacarpal(bvh: &Bvh, wrist: usize, finger: usize, chain: &[usize]) -> bool {
    let [first, second, ..] = chain else { return false };
    if finger == 0 {
        return chain.len() > 4 && bvh.joints[*first].name.contains('0') && !bvh.joints[*second].name.contains("02");
    }
    let to_wrist = std::iter::successors(Some(*first), |&j| bvh.joints[j].parent).take_while(|&j| j != wrist);
    chain.len() > 4 && to_wrist.map(|j| bone_length(bvh, j)).sum::<f64>() < bone_length(bvh, *second)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::skeleton::joint_names::match_names;

    #[test]
    fn joint_names_of_common_rigs_are_parsed() {
        let left = |finger| Some((Side::Left, finger));
        for (name, meant) in [
            ("mixamorig:LeftHandThumb1", left(0)),
            ("LeftHandIndex3_end", left(1)),
            ("LeftInHandMiddle", left(2)),
            ("b_l_ring0", left(3)),
            ("l_pinky_1", left(4)),
            ("LThumb1", left(0)),
            ("lthumb1", left(0)),
            ("lMid1", left(2)),
            ("CC_Base_L_Index1", left(1)),
            ("thumb_01_l", left(0)),
            ("Left Little Proximal", left(4)),
            ("RightHandPinky", Some((Side::Right, 4))),
            ("r.ring.2", Some((Side::Right, 3))),
            ("LeftHand", None),
            ("LeftToeIndex", None),
            ("SpineMiddle", None),
            ("String", None),
            ("Thumb", None),
        ] {
            assert_eq!(parse_name(name), meant, "{name}");
        }
    }

    /// A left hand: a thumb of three joints; an index finger with a metacarpal joint; a middle finger of four joints,
    /// the last bone without length; no other end sites.
    const HAND: &str = "HIERARCHY ROOT Hips { OFFSET 0 0 0 CHANNELS 3 Zrotation Xrotation Yrotation
        JOINT LeftHand { OFFSET 50 0 0 CHANNELS 0
          JOINT LeftHandThumb1 { OFFSET 3 0 2 CHANNELS 0 JOINT LeftHandThumb2 { OFFSET 4 0 1 CHANNELS 0
            JOINT LeftHandThumb3 { OFFSET 3 0 0 CHANNELS 0 End Site { OFFSET 2 0 0 } } } }
          JOINT LeftHandIndex { OFFSET 3 0 1 CHANNELS 0 JOINT LeftHandIndex1 { OFFSET 6 0 1 CHANNELS 0
            JOINT LeftHandIndex2 { OFFSET 4 0 0 CHANNELS 0 JOINT LeftHandIndex3 { OFFSET 2 0 0 CHANNELS 0
            End Site { OFFSET 2 0 0 } } } } }
          JOINT LeftHandMiddle1 { OFFSET 9 0 0 CHANNELS 0 JOINT LeftHandMiddle2 { OFFSET 4.5 0 0 CHANNELS 0
            JOINT LeftHandMiddle3 { OFFSET 2.5 0 0 CHANNELS 0 JOINT LeftHandMiddle4 { OFFSET 0 0 0 CHANNELS 0
            End Site { OFFSET 0 0 0 } } } } } } }
        MOTION Frames: 2 Frame Time: 0.04 0 0 0 90 0 0";

    #[test]
    fn hand_joints_are_ordered_by_finger() {
        let bvh = Bvh::parse(HAND).unwrap();
        let named = hand(&bvh, Side::Left).unwrap().map(|joint| joint.map(|joint| bvh.joints[joint].name.as_str()));
        assert_eq!((named[0], named[4]), (Some("LeftHand"), Some("LeftHandThumb3_end")));
        assert_eq!(named[5], Some("LeftHandIndex1"), "the joint in the palm is no knuckle");
        let ends = (named[11], named[12], named[13]);
        assert_eq!(ends, (Some("LeftHandMiddle3"), None, None), "a bone without length ends nowhere");
        assert_eq!(hand(&bvh, Side::Right), None);
        assert_eq!(hand(&Bvh::parse(&HAND.replace("LeftHand", "Tail")).unwrap(), Side::Left), None);

        // Fingers with numbers instead of names.
        let numbers = [("LeftHandThumb", "LeftFinger1-"), ("LeftHandMiddle", "LeftFinger3-")];
        let numbered = numbers.iter().fold(HAND.to_owned(), |text, (name, number)| text.replace(name, number));
        let numbered = Bvh::parse(&numbered.replace("LeftHandIndex", "Tail")).unwrap();
        assert_eq!(hand(&numbered, Side::Left), None);
        let names: Vec<&str> = numbered.joints.iter().map(|joint| joint.name.as_str()).collect();
        let bones = match_names(&names);
        let joints = matched_hand(&numbered, &bones, Side::Left).unwrap();
        let named = joints.map(|joint| joint.map(|joint| names[joint]));
        assert_eq!(
            named[..5],
            ["LeftHand", "LeftFinger1-1", "LeftFinger1-2", "LeftFinger1-3", "LeftFinger1-3_end"].map(Some)
        );
        assert_eq!((named[5], named[9]), (None, Some("LeftFinger3-1")));
        assert_eq!(matched_hand(&numbered, &bones, Side::Right), None);
    }
}
