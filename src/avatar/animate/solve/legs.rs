//! Legs below moving hips: feet stay planted on the floor and two-bone inverse kinematics bends the legs to them. When
//! standing, the hips move against the lean, so that the centre of mass stays above the feet.

use crate::animate::rig::rig::Rig;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, cross, norm, scale, sub, unit};
use orator_formats::bvh::write::BvhClip;

/// Posture of the lower body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Legs {
    /// Upright with the feet below the hips. If the hips do not rotate, the legs stay straight.
    #[default]
    Standing,
    /// Thighs horizontal, shins vertical.
    Seated,
    /// Hips and legs keep their rest pose.
    None,
}

/// Maximum extension of a standing leg relative to its length, so that the knee does not snap straight.
const MAX_STRETCH: f64 = 0.99;
/// Displacement of the hips relative to the trunk's top: the trunk has half the mass, and its centre moves half as far.
const BALANCE: f64 = 0.25;
const DOWN: Vec3 = [0.0, -1.0, 0.0];
const ACROSS: Vec3 = [1.0, 0.0, 0.0];
const FORWARD: Vec3 = [0.0, 0.0, 1.0];

struct Leg {
    upper: usize,
    lower: usize,
    foot: usize,
}

impl Leg {
    /// Lengths of thigh and shin, cm.
    fn lengths(&self, rig: &Rig) -> [f64; 2] {
        [self.lower, self.foot].map(|joint| norm(rig.skeleton.joints[joint].offset))
    }

    /// Rotates the leg so that it reaches by `way` from the hip joint to the ankle, the knee forward, the foot level.
    fn reach_ankle(&self, rig: &Rig, hips: Rotation, way: Vec3, local: &mut [Rotation]) {
        let [thigh, shin] = self.lengths(rig);
        let far = norm(way).clamp((thigh - shin).abs() + 1e-6, thigh + shin - 1e-6);
        let along = unit(way, 1e-9).unwrap_or(DOWN);
        let hinge = unit(cross(FORWARD, along), 1e-6).unwrap_or(ACROSS);
        let bends = cross(along, hinge);
        let cos = ((thigh * thigh + far * far - shin * shin) / (2.0 * thigh * far)).clamp(-1.0, 1.0);
        let to_knee = add(scale(along, cos), scale(bends, (1.0 - cos * cos).sqrt()));
        let from_knee = sub(scale(along, far), scale(to_knee, thigh));
        let bone = |to: Vec3| Rotation::between_frames((DOWN, ACROSS), (scale(to, 1.0 / norm(to)), hinge));
        let (thigh, shin) = (bone(to_knee), bone(from_knee));
        local[self.upper] = hips.inverse() * thigh;
        local[self.lower] = thigh.inverse() * shin;
        local[self.foot] = shin.inverse();
    }
}

impl Legs {
    /// Plants the feet of a clip under its hips and sets the travel of the hips.
    pub fn plant(self, rig: &Rig, clip: &mut BvhClip) {
        let is_static = clip.local.iter().all(|local| local[0] == Rotation::IDENTITY);
        if self == Self::None || (self == Self::Standing && is_static) {
            return;
        }
        let legs = rig.legs.map(|[upper, lower, foot, _]| Leg { upper, lower, foot });
        let rest = rig.skeleton.positions(clip.root, &vec![Rotation::IDENTITY; rig.skeleton.joints.len()]);
        let trunk = rest[rig.neck][1] - rest[0][1];
        let ankles = legs.each_ref().map(|leg| {
            let [thigh, _] = leg.lengths(rig);
            let ahead = if self == Self::Seated { thigh } else { 0.0 };
            add(rest[leg.foot], [0.0, 0.0, ahead])
        });
        let travel = clip.local.iter_mut().map(|local| {
            let hips = local[0];
            let sockets = legs.each_ref().map(|leg| hips.turn(rig.skeleton.joints[leg.upper].offset));
            let root = match self {
                Self::Seated => {
                    let [_, shin] = legs[0].lengths(rig);
                    let level = rig.skeleton.joints[legs[0].upper].offset[1];
                    [clip.root[0], ankles[0][1] + shin - level, clip.root[2]]
                }
                _ => {
                    let [x, _, z] = scale(hips.turn([0.0, 1.0, 0.0]), BALANCE * trunk);
                    let aside = [clip.root[0] - x, 0.0, clip.root[2] - z];
                    let height = |n: usize| {
                        let [dx, _, dz] = sub(ankles[n], add(aside, sockets[n]));
                        let reach = MAX_STRETCH * legs[n].lengths(rig).iter().sum::<f64>();
                        ankles[n][1] - sockets[n][1] + (reach * reach - dx * dx - dz * dz).max(0.0).sqrt()
                    };
                    [aside[0], height(0).min(height(1)), aside[2]]
                }
            };
            for n in 0..2 {
                legs[n].reach_ankle(rig, hips, sub(ankles[n], add(root, sockets[n])), local);
            }
            sub(root, clip.root)
        });
        clip.travel = travel.collect();
    }
}
