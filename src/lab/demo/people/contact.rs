//! Contacts: wrists are displaced so that hands and forearms do not penetrate the trunk, the desk, the thighs or each
//! other.

use super::body;
use super::body::{ArmPosture, Build, SIDES};
use super::motion::LeanStyle;
use super::trunk::TorsoPosition;
use orator_base::math::vec3::{Vec3, add, norm, scale, sub};
use orator_base::types::skeleton::{L_HAND, N_HAND_JOINTS, N_JOINTS, R_HAND};

/// Half width and depth of the clothed trunk, and distance of its lower end below the neck, metres of a body of unit
/// 1.
const TRUNK: [f64; 2] = [0.165, 0.14];
const TRUNK_END: f64 = 0.56;
/// Largest depth in cm from which a point below a surface is lifted onto it.
const MAX_DEPTH: f64 = 25.0;
/// Smallest distance between joints of the two hands, metres.
const MIN_HAND_DISTANCE: f64 = 0.024;
const ROUNDS: usize = 4;

/// Horizontal surface on which hands rest, world cm.
#[derive(Clone, Copy, Debug)]
pub struct Slab {
    pub top: f64,
    pub x: [f64; 2],
    pub z: [f64; 2],
    /// A hand whose planned wrist position is at least this far below the neck belongs under the surface, metres of a
    /// body of unit 1.
    pub below: f64,
}

/// Obstacles of a person's hands.
#[derive(Clone, Debug, Default)]
pub struct Obstacles {
    pub slabs: Vec<Slab>,
    /// Forward lean of the person.
    pub lean_style: LeanStyle,
    /// Side of the hand that is in front of the other.
    pub front: usize,
}

/// Half the thickness of a hand at a joint, cm: wrist, knuckles, other finger joints.
fn thickness(joint: usize) -> f64 {
    match joint {
        0 => 3.0,
        _ if joint % 4 == 1 => 1.9,
        _ => 1.2,
    }
}

impl Obstacles {
    /// Joints of the arms in the torso's axes, metres, after resolving contacts.
    pub fn resolve(&self, build: &Build, arms: &[ArmPosture; 2], torso: &TorsoPosition) -> [Vec3; N_JOINTS] {
        let unit = build.unit();
        let mut wrists = arms.each_ref().map(|posture| scale(self.lean_style.wrist(posture.wrist), unit));
        let mut joints = body::joints(build, arms, wrists);
        for _ in 0..ROUNDS {
            let mut displacements = [0, 1].map(|side| {
                let (shoulder, root, _) = SIDES[side];
                let hand = &joints[root..root + N_HAND_JOINTS];
                let displacement = out_of_trunk(hand, unit);
                let forearm = scale(add(joints[shoulder + 1], joints[shoulder + 2]), 0.5);
                add(displacement, self.onto_slabs(arms[side].wrist[1], (hand, forearm), torso))
            });
            let overlap = hand_overlap(&joints);
            displacements[self.front][2] -= 0.5 * overlap;
            displacements[1 - self.front][2] += 0.5 * overlap;
            if displacements.iter().all(|displacement| norm(*displacement) < 1e-4) {
                break;
            }
            for ((wrist, displacement), (_, _, sign)) in wrists.iter_mut().zip(displacements).zip(SIDES) {
                *wrist = add(*wrist, [sign * displacement[0], displacement[1], displacement[2]]);
            }
            joints = body::joints(build, arms, wrists);
        }
        joints
    }

    /// Displacement in metres (torso axes) that lifts a hand onto the surfaces; `below` is the planned distance of its
    /// wrist below the neck.
    fn onto_slabs(&self, below: f64, (hand, forearm): (&[Vec3], Vec3), torso: &TorsoPosition) -> Vec3 {
        let joints = hand.iter().enumerate().map(|(joint, &at)| (torso.world(at), thickness(joint)));
        let points: Vec<(Vec3, f64)> = joints.chain([(torso.world(forearm), 3.5)]).collect();
        let lift = self.slabs.iter().filter(|slab| below < slab.below).flat_map(|slab| {
            points.iter().map(move |([x, y, z], thick)| {
                let over = (slab.x[0]..slab.x[1]).contains(x) && (slab.z[0]..slab.z[1]).contains(z);
                let lift = slab.top + thick - y;
                if over && lift < MAX_DEPTH { lift.max(0.0) } else { 0.0 }
            })
        });
        torso.displacement([0.0, lift.fold(0.0, f64::max), 0.0])
    }
}

/// Forward displacement out of the trunk's ellipse, metres.
fn out_of_trunk(hand: &[Vec3], unit: f64) -> Vec3 {
    let [half, depth] = TRUNK.map(|metres| metres * unit);
    let ahead = hand.iter().enumerate().map(|(joint, &[x, down, away])| {
        let room = 1.0 - (x / half).powi(2);
        if room <= 0.0 || !(0.0..TRUNK_END * unit).contains(&down) {
            return 0.0;
        }
        (depth * room.sqrt() + thickness(joint) / 100.0 + away).max(0.0)
    });
    [0.0, 0.0, -ahead.fold(0.0, f64::max)]
}

/// Penetration depth of the two hands, metres.
fn hand_overlap(joints: &[Vec3; N_JOINTS]) -> f64 {
    let hand = |root: usize| &joints[root..root + N_HAND_JOINTS];
    let mut min_distance = f64::INFINITY;
    for a in hand(L_HAND) {
        for b in hand(R_HAND) {
            min_distance = min_distance.min(norm(sub(*a, *b)));
        }
    }
    (MIN_HAND_DISTANCE - min_distance).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::people::body::FingerShape;
    use crate::demo::people::condition::Seat;
    use crate::demo::people::motion::TrunkPosture;
    use crate::demo::people::trunk::SeatedRig;

    #[test]
    fn hands_stay_on_a_desk_and_before_the_trunk() {
        let build = Build::ADULT;
        let rig = build.rig();
        let seated = SeatedRig { rig: &rig, seat: Seat::Desk, knees: 0.1, shins: 0.1 };
        let torso = seated.torso(&TrunkPosture::default());
        let slab = Slab { top: torso.neck[1] - 36.0, x: [-60.0, 60.0], z: [26.0, 90.0], below: 0.5 };
        let low = ArmPosture {
            wrist: [0.12, 0.42, -0.36],
            elbow: 0.3,
            forward: 0.0,
            roll: 1.2,
            raise: 0.0,
            inwards: 0.3,
            fingers: FingerShape::FLAT,
        };
        let inside = ArmPosture { wrist: [0.05, 0.2, -0.04], ..low };
        let obstacles = Obstacles { slabs: vec![slab], lean_style: LeanStyle::default(), front: 0 };
        let joints = obstacles.resolve(&build, &[low, inside], &torso);
        for &joint in &joints[L_HAND..L_HAND + N_HAND_JOINTS] {
            assert!(torso.world(joint)[1] > slab.top, "{joint:?}");
        }
        for &[x, _, away] in &joints[R_HAND..R_HAND + N_HAND_JOINTS] {
            assert!(x.abs() > 0.16 || away < -0.05, "{x} {away}");
        }
    }
}
