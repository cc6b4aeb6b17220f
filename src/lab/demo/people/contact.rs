//! Contacts: wrists are moved so that hands and forearms stay out of the trunk, the desk, the thighs and each other.

use super::acts::Carriage;
use super::body;
use super::body::{ArmPosture, Build, SIDES};
use super::trunk::TorsoPlace;
use orator_base::math::vec3::{Vec3, add, norm, scale, sub};
use orator_base::types::skeleton::{L_HAND, N_HAND_JOINTS, N_JOINTS, R_HAND};

/// Half width and depth of the trunk with clothes, metres of a body of unit 1, and its lower end below the neck.
const TRUNK: [f64; 2] = [0.165, 0.14];
const TRUNK_END: f64 = 0.56;
/// How deep below a surface a point may be and still be lifted onto it, cm.
const DEEPEST: f64 = 25.0;
/// Shortest distance of two hands' joints, metres.
const APART: f64 = 0.024;
const ROUNDS: usize = 4;

/// Horizontal surface that hands lie on, world cm.
#[derive(Clone, Copy, Debug)]
pub struct Slab {
    pub top: f64,
    pub x: [f64; 2],
    pub z: [f64; 2],
    /// A hand whose wrist is meant to be this far below the neck is under the surface, metres of a body of unit 1.
    pub beneath: f64,
}

/// What a person's hands may touch.
#[derive(Clone, Debug, Default)]
pub struct Obstacles {
    pub slabs: Vec<Slab>,
    /// How the arms are carried.
    pub carriage: Carriage,
    /// Side of the hand that passes before the other.
    pub front: usize,
}

/// Half thickness of a hand at its joint, cm: wrist, palm, fingers.
fn thickness(joint: usize) -> f64 {
    match joint {
        0 => 3.0,
        _ if joint % 4 == 1 => 1.9,
        _ => 1.2,
    }
}

impl Obstacles {
    /// Joints of the arms in the torso's axes, metres, out of everything.
    pub fn free(&self, build: &Build, arms: &[ArmPosture; 2], torso: &TorsoPlace) -> [Vec3; N_JOINTS] {
        let unit = build.unit();
        let mut wrists = arms.each_ref().map(|posture| scale(self.carriage.wrist(posture.wrist), unit));
        let mut joints = body::joints(build, arms, wrists);
        for _ in 0..ROUNDS {
            let mut ways = [0, 1].map(|side| {
                let (shoulder, root, _) = SIDES[side];
                let hand = &joints[root..root + N_HAND_JOINTS];
                let way = out_of_trunk(hand, unit);
                let forearm = scale(add(joints[shoulder + 1], joints[shoulder + 2]), 0.5);
                add(way, self.onto_slabs(arms[side].wrist[1], (hand, forearm), torso))
            });
            let between = apart(&joints);
            ways[self.front][2] -= 0.5 * between;
            ways[1 - self.front][2] += 0.5 * between;
            if ways.iter().all(|way| norm(*way) < 1e-4) {
                break;
            }
            for ((wrist, way), (_, _, sign)) in wrists.iter_mut().zip(ways).zip(SIDES) {
                *wrist = add(*wrist, [sign * way[0], way[1], way[2]]);
            }
            joints = body::joints(build, arms, wrists);
        }
        joints
    }

    /// Way up onto the surfaces, metres, of a hand that is meant to be `below` the neck.
    fn onto_slabs(&self, below: f64, (hand, forearm): (&[Vec3], Vec3), torso: &TorsoPlace) -> Vec3 {
        let joints = hand.iter().enumerate().map(|(joint, &at)| (torso.world(at), thickness(joint)));
        let points: Vec<(Vec3, f64)> = joints.chain([(torso.world(forearm), 3.5)]).collect();
        let lift = self.slabs.iter().filter(|slab| below < slab.beneath).flat_map(|slab| {
            points.iter().map(move |([x, y, z], thick)| {
                let over = (slab.x[0]..slab.x[1]).contains(x) && (slab.z[0]..slab.z[1]).contains(z);
                let lift = slab.top + thick - y;
                if over && lift < DEEPEST { lift.max(0.0) } else { 0.0 }
            })
        });
        torso.way([0.0, lift.fold(0.0, f64::max), 0.0])
    }
}

/// Way ahead out of the trunk's ellipse, metres.
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

/// How far two hands are into each other, metres.
fn apart(joints: &[Vec3; N_JOINTS]) -> f64 {
    let hand = |root: usize| &joints[root..root + N_HAND_JOINTS];
    let mut least = f64::INFINITY;
    for a in hand(L_HAND) {
        for b in hand(R_HAND) {
            least = least.min(norm(sub(*a, *b)));
        }
    }
    (APART - least).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::people::acts::TrunkPosture;
    use crate::demo::people::body::FingerShape;
    use crate::demo::people::condition::Seat;
    use crate::demo::people::trunk::SeatedRig;

    #[test]
    fn hands_stay_on_a_desk_and_before_the_trunk() {
        let build = Build::ADULT;
        let rig = build.rig();
        let seated = SeatedRig { rig: &rig, seat: Seat::Desk, knees: 0.1, shins: 0.1 };
        let torso = seated.torso(&TrunkPosture::default());
        let slab = Slab { top: torso.neck[1] - 36.0, x: [-60.0, 60.0], z: [26.0, 90.0], beneath: 0.5 };
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
        let obstacles = Obstacles { slabs: vec![slab], carriage: Carriage::default(), front: 0 };
        let joints = obstacles.free(&build, &[low, inside], &torso);
        for &joint in &joints[L_HAND..L_HAND + N_HAND_JOINTS] {
            assert!(torso.world(joint)[1] > slab.top, "{joint:?}");
        }
        for &[x, _, away] in &joints[R_HAND..R_HAND + N_HAND_JOINTS] {
            assert!(x.abs() > 0.16 || away < -0.05, "{x} {away}");
        }
    }
}
