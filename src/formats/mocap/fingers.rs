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
pub fn matched_hand(bvh: &Bvh, bones: &BTreeMap<String, usize>, side: Side) -> Option<[Option<usize>; N_HAND]> {
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

/// Side and finger, 0 (thumb) to 4, that the name of a joint states; `None` if it is no joint of a finger.
pub fn parse_name(name: &str) -> Option<(Side, usize)> {
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
