//! Skinning weights. Along a chain of joints, weights change smoothly from one joint to the next where the bone bends;
//! between chains, a vertex belongs to the nearer one. All weights are smoothed over the surface.

use super::body::BodyForm;
use super::jaw::smooth_step;
use super::stance::{HIPS, finger_joints};
use super::surface::Surface;
use orator_base::math::vec3::{Vec3, dot, norm, sub};

/// Joints of a vertex with their weights, which sum to 1.
pub type Weights = [(usize, f64); 4];

/// Weights of a vertex that follows a single joint.
pub fn rigid(joint: usize) -> Weights {
    [(joint, 1.0), (0, 0.0), (0, 0.0), (0, 0.0)]
}

/// Sparse weights of one vertex, by joint.
type Shares = Vec<(usize, f64)>;

/// A chain of joints and the transitions between them.
struct WeightChain {
    joints: Vec<usize>,
    /// For each joint but the first: position and normal of the transition plane, half the transition's width (cm).
    transitions: Vec<(Vec3, Vec3, f64)>,
}

impl WeightChain {
    fn shares(&self, at: Vec3, whole: f64, into: &mut Shares) {
        let mut left = whole;
        for (k, &joint) in self.joints.iter().enumerate() {
            let on = self
                .transitions
                .get(k)
                .map_or(0.0, |(place, normal, half)| smooth_step(dot(sub(at, *place), *normal) / half));
            add_share(into, joint, left * (1.0 - on));
            left *= on;
        }
    }
}

fn add_share(into: &mut Shares, joint: usize, share: f64) {
    if share > 1e-6 {
        match into.iter_mut().find(|(known, _)| *known == joint) {
            Some((_, sum)) => *sum += share,
            None => into.push((joint, share)),
        }
    }
}

impl BodyForm<'_> {
    /// Chain whose transition planes bisect the angle between the bones at each joint; `halves` in cm of the rig.
    fn chain(&self, before: usize, joints: &[usize], after: usize, halves: &[f64]) -> WeightChain {
        let stance = self.stance;
        let at = |k: usize| joints.get(k).copied().unwrap_or(after);
        let transitions = (1..joints.len()).map(|k| {
            let previous = if stance.positions[at(k)] == stance.positions[at(k - 1)] { before } else { at(k - 1) };
            let (a, b) = (stance.direction(previous, at(k)), stance.direction(at(k), at(k + 1)));
            let normal = [0, 1, 2].map(|i| a[i] + b[i]);
            let length = norm(normal).max(1e-6);
            (stance.positions[at(k)], normal.map(|v| v / length), halves[k - 1])
        });
        WeightChain { joints: joints.to_vec(), transitions: transitions.collect() }
    }

    /// Chain of hips, spine, chest, neck and head.
    fn spine(&self) -> WeightChain {
        let rig = self.rig;
        let cm = self.stance.scale;
        let up = |joint: usize, higher: f64, half: f64| {
            (self.stance.at(joint, [0.0, higher, 0.0]), [0.0, 1.0, 0.0], half * cm)
        };
        // The plane between head and neck rises from below the chin to the nape.
        let jaw = (self.stance.at(rig.head, [0.0, -1.0, 0.0]), [0.0, 0.876, 0.482], 3.2 * cm);
        WeightChain {
            joints: vec![HIPS, rig.spine, rig.chest, rig.neck, rig.head],
            transitions: vec![up(rig.spine, 0.0, 7.0), up(rig.chest, 0.0, 8.0), up(rig.neck, 5.0, 3.5), jaw],
        }
    }

    pub fn head_weights(&self, surface: &Surface) -> Vec<Weights> {
        let spine = self.spine();
        smoothed_weights(surface, 2, |at, shares| spine.shares(at, 1.0, shares))
    }

    pub fn shirt_weights(&self, surface: &Surface) -> Vec<Weights> {
        let cm = self.stance.scale;
        let mut spine = self.spine();
        // The collar follows the chest.
        spine.joints.truncate(3);
        spine.transitions.truncate(2);
        let trunk = self.trunk();
        let arms = [0, 1].map(|side| {
            let arm = &self.rig.arms[side];
            let chain = self.chain(arm.clavicle, &[arm.upper, arm.forearm], arm.hand, &[4.2 * cm]);
            (arm, self.sleeve(side), chain)
        });
        smoothed_weights(surface, 14, |at, shares| {
            let mut left = 1.0;
            let trunk_distance = trunk.distance(at);
            for (arm, sleeve, chain) in &arms {
                let shoulder = self.stance.positions[arm.upper];
                let out = arm.sign * (at[0] - shoulder[0]) / cm;
                let on_arm = smooth_step((trunk_distance - sleeve.distance(at)) / (1.5 * cm) - 0.6)
                    * smooth_step((out + 1.0) / 3.0);
                // The clavicle moves the top of the trunk, increasingly towards the shoulder.
                let high = smooth_step((at[1] - shoulder[1] + 9.0 * cm) / (9.0 * cm));
                let on_shoulder = high * smooth_step((out + 7.0) / 6.0);
                chain.shares(at, left * on_arm, shares);
                add_share(shares, arm.clavicle, left * (1.0 - on_arm) * on_shoulder);
                left *= (1.0 - on_arm) * (1.0 - on_shoulder);
            }
            spine.shares(at, left, shares);
        })
    }

    pub fn leg_weights(&self, surface: &Surface) -> Vec<Weights> {
        let cm = self.stance.scale;
        let chains = self.rig.legs.map(|[upper, lower, foot, end]| {
            self.chain(HIPS, &[HIPS, upper, lower, foot], end, &[6.0 * cm, 5.0 * cm, 2.5 * cm])
        });
        smoothed_weights(surface, 3, |at, shares| {
            let side = usize::from(at[0] < 0.0);
            chains[side].shares(at, 1.0, shares);
        })
    }

    /// Weights of a skirt: the hips, and towards the hem increasingly the nearer thigh.
    pub fn skirt_weights(&self, surface: &Surface) -> Vec<Weights> {
        let cm = self.stance.scale;
        let top = self.stance.positions[HIPS];
        smoothed_weights(surface, 10, |at, shares| {
            let thigh = self.rig.legs[usize::from(at[0] < 0.0)][0];
            let low = 0.75 * smooth_step((top[1] - at[1] - 22.0 * cm) / (18.0 * cm));
            add_share(shares, thigh, low);
            add_share(shares, HIPS, 1.0 - low);
        })
    }

    /// Weights of one of the four fingers; `scale` is the size of the hand.
    pub fn finger_weights(&self, side: usize, finger: usize, scale: f64, surface: &Surface) -> Vec<Weights> {
        let chain = self.finger(side, finger, scale);
        smoothed_weights(surface, 1, |at, shares| chain.shares(at, 1.0, shares))
    }

    fn finger(&self, side: usize, finger: usize, scale: f64) -> WeightChain {
        let arm = &self.rig.arms[side];
        let [a, b, c, tip] = finger_joints(self.rig, side, finger);
        let halves = if finger == 0 { [1.5, 0.9, 0.8] } else { [0.9, 0.75, 0.65] };
        self.chain(arm.forearm, &[arm.hand, a, b, c], tip, &halves.map(|half| half * scale))
    }

    /// Weights of a palm with its thumb, the wrist and a bare arm; `scale` is the size of the hand.
    pub fn palm_weights(&self, side: usize, scale: f64, surface: &Surface) -> Vec<Weights> {
        let arm = &self.rig.arms[side];
        let thumb = self.finger(side, 0, scale);
        let knuckles: [usize; 5] = std::array::from_fn(|finger| finger_joints(self.rig, side, finger)[0]);
        let bends = [4.0 * self.stance.scale, 2.6 * scale];
        let wrist = self.chain(arm.clavicle, &[arm.upper, arm.forearm, arm.hand], knuckles[2], &bends);
        let positions = &self.stance.positions;
        let thumb_line = finger_joints(self.rig, side, 0).map(|joint| positions[joint]);
        smoothed_weights(surface, 4, |at, shares| {
            let on_thumb = thumb_line.windows(2).map(|ends| distance_to_segment(at, ends[0], ends[1]));
            let on_thumb = on_thumb.fold(f64::INFINITY, f64::min);
            let on_palm =
                knuckles[1..].iter().map(|&knuckle| distance_to_segment(at, positions[arm.hand], positions[knuckle]));
            let on_palm = on_palm.fold(f64::INFINITY, f64::min);
            let mut on_hand = Shares::new();
            wrist.shares(at, 1.0, &mut on_hand);
            for (joint, share) in on_hand {
                if joint == arm.hand && on_thumb < on_palm {
                    thumb.shares(at, share, shares);
                } else {
                    add_share(shares, joint, share);
                }
            }
        })
    }
}

fn distance_to_segment(at: Vec3, a: Vec3, b: Vec3) -> f64 {
    let along = sub(b, a);
    let share = (dot(sub(at, a), along) / dot(along, along).max(1e-12)).clamp(0.0, 1.0);
    norm([0, 1, 2].map(|k| at[k] - a[k] - share * along[k]))
}

/// Computes the weights of every vertex, smooths them `rounds` times over its neighbours, and retains the four largest.
fn smoothed_weights(surface: &Surface, rounds: usize, of: impl Fn(Vec3, &mut Shares)) -> Vec<Weights> {
    let mut all: Vec<Shares> = surface
        .points
        .iter()
        .map(|&at| {
            let mut shares = Shares::new();
            of(at, &mut shares);
            shares
        })
        .collect();
    let near = surface.neighbours();
    for _ in 0..rounds {
        let smoothed = all.iter().zip(&near).map(|(own, near)| {
            let mut sum = Shares::new();
            own.iter().for_each(|&(joint, share)| add_share(&mut sum, joint, 0.5 * share));
            for &other in near {
                let part = 0.5 / near.len() as f64;
                all[other as usize].iter().for_each(|&(joint, share)| add_share(&mut sum, joint, part * share));
            }
            sum
        });
        all = smoothed.collect();
    }
    all.into_iter()
        .map(|mut shares| {
            shares.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            shares.resize(4, (0, 0.0));
            let sum: f64 = shares.iter().map(|share| share.1).sum();
            std::array::from_fn(|k| (shares[k].0, shares[k].1 / sum))
        })
        .collect()
}
