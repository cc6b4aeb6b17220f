//! Bones of a skeleton with unknown joint names, found by its structure: two pairs of equally long limbs, of which the
//! legs start nearer to the root than the arms, and the chain from the hips to the head. Feet point forward.

use super::matched::MatchJoint;
use orator_base::math::vec3::{Vec3, across, add, cross, dot, norm, scale, sub, unit};
use std::collections::BTreeMap;

/// Maximum number of joints of a limb that are considered.
const MAX_CHAIN: usize = 16;
/// Number of pairs of limbs, longest first, among which arms and legs are selected.
const MAX_PAIRS: usize = 8;
/// Maximum relative difference between the lengths of a left and a right limb.
const MAX_DIFFERENCE: f64 = 0.1;
/// Minimum length of arms and legs relative to the longest limb, which excludes fingers.
const MIN_LENGTH: f64 = 0.3;
/// Minimum share of the feet's length that points forward.
const MIN_FORWARD: f64 = 0.3;
/// Minimum share of the x axis in the line between both arms if nothing else distinguishes left and right.
const MIN_SIDEWAYS: f64 = 0.5;

/// A chain of joints whose two longest consecutive bones are upper arm and forearm, or the parts of a leg.
#[derive(Clone, Debug)]
struct Limb {
    chain: Vec<usize>,
    /// Index in the chain of the joint at which the longer bones begin.
    upper: usize,
    lengths: [f64; 2],
}

/// Two limbs of the same joint.
#[derive(Clone, Debug)]
struct LimbPair {
    parent: usize,
    limbs: [Limb; 2],
}

struct JointTree<'a> {
    joints: &'a [MatchJoint<'a>],
    children: Vec<Vec<usize>>,
    /// Number of joints from each joint to its farthest descendant, both included.
    depths: Vec<usize>,
}

/// Joints of our bones as far as the structure shows them; empty without a pair of arms, or if left and right cannot
/// be distinguished. `named` are bones with known joints, which decide which side is the left.
pub(super) fn match_structure(joints: &[MatchJoint], named: &BTreeMap<String, usize>) -> BTreeMap<String, usize> {
    JointTree::new(joints).bones(named).unwrap_or_default()
}

impl Limb {
    fn length(&self) -> f64 {
        self.lengths[0] + self.lengths[1]
    }

    fn is_like(&self, other: &Self) -> bool {
        let limit = MAX_DIFFERENCE * self.length().max(other.length());
        let is_close = (0..2).all(|k| (self.lengths[k] - other.lengths[k]).abs() <= limit);
        self.upper == other.upper && is_close && limit > 0.0
    }

    /// Upper joint, middle joint, end.
    fn joints(&self) -> [usize; 3] {
        [0, 1, 2].map(|k| self.chain[self.upper + k])
    }
}

impl<'a> JointTree<'a> {
    fn new(joints: &'a [MatchJoint<'a>]) -> Self {
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); joints.len()];
        let mut depths = vec![1_usize; joints.len()];
        for (n, joint) in joints.iter().enumerate().rev() {
            if let Some(parent) = joint.parent {
                children[parent].push(n);
                depths[parent] = depths[parent].max(depths[n] + 1);
            }
        }
        children.iter_mut().for_each(|joints| joints.reverse());
        Self { joints, children, depths }
    }

    fn bones(&self, named: &BTreeMap<String, usize>) -> Option<BTreeMap<String, usize>> {
        let pairs = self.pairs();
        let body = pairs
            .iter()
            .flat_map(|legs| pairs.iter().filter_map(move |arms| Some((self.hips(legs, arms)?, legs, arms))));
        let length = |pair: &LimbPair| pair.limbs[0].length();
        let body = body.max_by(|a, b| (length(a.1) + length(a.2)).total_cmp(&(length(b.1) + length(b.2))));
        let (hips, legs, arms) = match body {
            Some((hips, legs, arms)) => (Some(hips), Some(legs), arms),
            None => (None, None, pairs.first()?),
        };
        let neck = self.neck(arms);
        // A single pair without a head, or at the root, may be legs.
        let has_trunk = self.joints[arms.parent].parent.is_some_and(|parent| self.joints[parent].moves);
        if legs.is_none() && (neck.is_empty() || !has_trunk) {
            return None;
        }
        let left = self.left(arms, legs, named)?;
        let mut bones = BTreeMap::new();
        let mut insert = |own: String, joint: usize| {
            bones.insert(own, joint);
        };
        if let Some(hips) = hips {
            insert("Hips".to_owned(), hips);
            if let Some(spine) = self.path(arms.parent).take_while(|&joint| joint != hips).last() {
                insert("Spine".to_owned(), spine);
            }
        }
        match neck.as_slice() {
            [] => {}
            [head] => insert("Head".to_owned(), *head),
            [neck, head, ..] => {
                insert("Neck".to_owned(), *neck);
                insert("Head".to_owned(), *head);
            }
        }
        let kinds = [(Some(arms), ["Arm", "ForeArm", "Hand"]), (legs, ["UpLeg", "Leg", "Foot"])];
        for (pair, parts) in kinds.into_iter().filter_map(|(pair, parts)| Some((pair?, parts))) {
            let [first, second] = pair.limbs.each_ref().map(|limb| self.joints[limb.joints()[0]].position);
            let is_first_left = dot(sub(first, second), left) > 0.0;
            for (limb, is_left) in pair.limbs.iter().zip([is_first_left, !is_first_left]) {
                let side = if is_left { "Left" } else { "Right" };
                parts.into_iter().zip(limb.joints()).for_each(|(part, joint)| insert(format!("{side}{part}"), joint));
                if parts[0] == "Arm" && limb.upper > 0 {
                    insert(format!("{side}Shoulder"), limb.chain[limb.upper - 1]);
                }
            }
        }
        Some(bones)
    }

    /// Pairs of equally long limbs with a common parent, longest first.
    fn pairs(&self) -> Vec<LimbPair> {
        let (mut pairs, mut longest) = (Vec::new(), 0.0f64);
        for (parent, children) in self.children.iter().enumerate() {
            let mut limbs: Vec<Limb> = children.iter().filter_map(|&child| self.limb(child)).collect();
            limbs.sort_by(|a, b| b.length().total_cmp(&a.length()));
            longest = limbs.iter().map(Limb::length).fold(longest, f64::max);
            for two in limbs.windows(2).filter(|two| two[0].is_like(&two[1])) {
                pairs.push(LimbPair { parent, limbs: [two[0].clone(), two[1].clone()] });
            }
        }
        pairs.retain(|pair: &LimbPair| pair.limbs[1].length() >= MIN_LENGTH * longest);
        pairs.sort_by(|a, b| b.limbs[0].length().total_cmp(&a.limbs[0].length()));
        pairs.truncate(MAX_PAIRS);
        pairs
    }

    /// The limb that starts at a joint; `None` for fewer than three joints.
    fn limb(&self, start: usize) -> Option<Limb> {
        let chain = self.chain(start);
        let length = |k: usize| norm(sub(self.joints[chain[k + 1]].position, self.joints[chain[k]].position));
        let both = |upper: usize| [length(upper), length(upper + 1)];
        let sum = |upper: usize| both(upper).iter().sum::<f64>();
        // Of equal sums the first counts.
        let upper = (0..chain.len().saturating_sub(2)).rev().max_by(|&a, &b| sum(a).total_cmp(&sum(b)))?;
        let lengths = both(upper);
        Some(Limb { chain, upper, lengths })
    }

    /// Moving joints from `start` down to a leaf or to a joint with several chains, such as a hand with fingers.
    fn chain(&self, start: usize) -> Vec<usize> {
        let next = |&joint: &usize| {
            let is_hand = self.children[joint].iter().filter(|&&child| self.depths[child] > 1).count() > 1;
            let longest = || self.children[joint].iter().copied().rev().max_by_key(|&child| self.depths[child]);
            if is_hand { None } else { longest().filter(|&child| self.joints[child].moves) }
        };
        let first = Some(start).filter(|&start| self.joints[start].moves);
        std::iter::successors(first, next).take(MAX_CHAIN).collect()
    }

    /// The joint and its ancestors.
    fn path(&self, joint: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(joint), |&at| self.joints[at].parent)
    }

    /// The lowest joint that carries both pairs, if the arms are farther from it than the legs.
    fn hips(&self, legs: &LimbPair, arms: &LimbPair) -> Option<usize> {
        let to_legs: Vec<usize> = self.path(legs.parent).collect();
        let (n_arms, hips) = self.path(arms.parent).enumerate().find(|(_, joint)| to_legs.contains(joint))?;
        let n_legs = to_legs.iter().position(|&joint| joint == hips)?;
        (n_arms > n_legs).then_some(hips)
    }

    /// The longest chain beside both arms, which carries the head.
    fn neck(&self, arms: &LimbPair) -> Vec<usize> {
        let is_arm = |child: usize| arms.limbs.iter().any(|limb| limb.chain[0] == child);
        let others = self.children[arms.parent].iter().copied().filter(|&child| !is_arm(child));
        let start = others.filter(|&child| self.joints[child].moves).rev().max_by_key(|&child| self.depths[child]);
        start.map(|start| self.chain(start)).unwrap_or_default()
    }

    /// Direction to the left: by named joints, or by the feet, or along x if the arms are spread along x.
    fn left(&self, arms: &LimbPair, legs: Option<&LimbPair>, named: &BTreeMap<String, usize>) -> Option<Vec3> {
        let at = |joint: usize| self.joints[joint].position;
        let ends = |pair: &LimbPair| pair.limbs.each_ref().map(|limb| at(limb.joints()[0]));
        for pair in [Some(arms), legs].into_iter().flatten() {
            let of_side = |side: &str, limb: &Limb| {
                let mut joints = named.iter().filter(|(own, _)| own.starts_with(side)).map(|(_, joint)| joint);
                joints.any(|joint| limb.chain.contains(joint))
            };
            let [first, second] = ends(pair);
            let [a, b] = pair.limbs.each_ref();
            let is_first = of_side("Left", a) || of_side("Right", b);
            let is_second = of_side("Left", b) || of_side("Right", a);
            if is_first != is_second {
                return Some(if is_first { sub(first, second) } else { sub(second, first) });
            }
        }
        let middle = |[a, b]: [Vec3; 2]| scale(add(a, b), 0.5);
        let by_feet = legs.and_then(|legs| {
            let up = unit(sub(middle(ends(arms)), middle(ends(legs))), 0.0)?;
            let toe = |limb: &Limb| {
                let foot = limb.joints()[2];
                let toe = self.children[foot].iter().copied().max_by_key(|&child| self.depths[child])?;
                Some(sub(at(toe), at(foot)))
            };
            let [a, b] = legs.limbs.each_ref().map(toe);
            let (a, b) = (a?, b?);
            let forward = across(add(a, b), up);
            (norm(forward) > MIN_FORWARD * (norm(a) + norm(b))).then(|| cross(up, forward))
        });
        // Files are y or z up, and a person at rest has the left side at +x.
        by_feet.or_else(|| {
            let [first, second] = ends(arms);
            let between = sub(first, second);
            (between[0].abs() > MIN_SIDEWAYS * norm(between)).then_some([1.0, 0.0, 0.0])
        })
    }
}
