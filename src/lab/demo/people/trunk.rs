//! Trunk, head and legs of a rendered person on its rig: conversion of postures to local rotations, and of the torso's
//! axes to world axes (cm, y up, the person faces +z, the floor at y = 0).

use super::condition::Seat;
use super::motion::TrunkPosture;
use orator_avatar::animate::rig::rig::{CM, Rig};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, norm, scale};

const X: Vec3 = [1.0, 0.0, 0.0];
const Y: Vec3 = [0.0, 1.0, 0.0];
const Z: Vec3 = [0.0, 0.0, 1.0];

/// Position and orientation of a torso in the world.
#[derive(Clone, Copy, Debug)]
pub struct TorsoPosition {
    /// Neck, cm.
    pub neck: Vec3,
    pub turn: Rotation,
}

impl TorsoPosition {
    /// Converts a point from the torso's axes (metres, y down, z away from the viewer) to world cm.
    pub fn world(&self, [x, down, away]: Vec3) -> Vec3 {
        add(self.neck, self.turn.turn(scale([x, -down, -away], CM)))
    }

    /// Converts a displacement from world cm to the torso's axes, metres.
    pub fn displacement(&self, cm: Vec3) -> Vec3 {
        let [x, y, z] = scale(self.turn.inverse().turn(cm), 1.0 / CM);
        [x, -y, -z]
    }
}

/// A standing or seated rig.
pub struct SeatedRig<'a> {
    pub rig: &'a Rig,
    pub seat: Seat,
    /// Outward rotation of the knees, and pitch of the shins that puts the feet forwards or under the seat, radians.
    pub knees: f64,
    pub shins: f64,
}

impl SeatedRig<'_> {
    /// Position of the hips, cm.
    pub fn root(&self, posture: &TrunkPosture) -> Vec3 {
        let rig = self.rig;
        let length = |name: &str| rig.skeleton.find(name).map_or(0.0, |joint| norm(rig.skeleton.joints[joint].offset));
        let height = match self.seat {
            Seat::Standing => rig.root[1],
            // Thighs are level and shins nearly upright: the hips are one shin length above the ankles.
            _ => rig.root[1] - length("LeftLeg") - (1.0 - self.shins.cos()) * length("LeftFoot"),
        };
        [rig.root[0] + CM * posture.shift, height, rig.root[2]]
    }

    /// Sets the local rotations of trunk, head and legs; those of the arms remain.
    pub fn pose(&self, posture: &TrunkPosture, local: &mut [Rotation]) {
        let rig = self.rig;
        let [turn, lean, side] = posture.trunk;
        let part = |share: [f64; 3]| {
            Rotation::about(Y, share[0] * turn)
                * Rotation::about(X, share[1] * lean)
                * Rotation::about(Z, -share[2] * side)
        };
        // A standing person turns and bends mostly above the hips.
        let hips = if self.seat == Seat::Standing { [0.2, 0.4, 0.3] } else { [0.2, 0.6, 0.4] };
        local[0] = part(hips);
        local[rig.spine] = part(hips.map(|share| (1.0 - share) / 2.0));
        local[rig.chest] = part(hips.map(|share| (1.0 - share) / 2.0));
        let [yaw, nod, tilt] = posture.head.map(|angle| angle / 2.0);
        let half = Rotation::about(Y, yaw) * Rotation::about(X, nod) * Rotation::about(Z, -tilt);
        local[rig.neck] = half;
        local[rig.head] = half;
        for (name, sign) in [("Left", 1.0), ("Right", -1.0)] {
            let find = |part: &str| rig.skeleton.find(&format!("{name}{part}"));
            let (Some(upper), Some(lower), Some(foot)) = (find("UpLeg"), find("Leg"), find("Foot")) else { continue };
            let out = Rotation::about(Y, sign * self.knees);
            let (thigh, shin) = match self.seat {
                Seat::Standing => {
                    (Rotation::about(Z, sign * 0.3 * self.knees), Rotation::about(Z, sign * 0.3 * self.knees))
                }
                _ => (out * Rotation::about(X, -std::f64::consts::FRAC_PI_2), out * Rotation::about(X, self.shins)),
            };
            local[upper] = local[0].inverse() * thigh;
            local[lower] = thigh.inverse() * shin;
            local[foot] = shin.inverse() * out;
        }
    }

    /// Position and orientation of the torso in a posture.
    pub fn torso(&self, posture: &TrunkPosture) -> TorsoPosition {
        let mut local = vec![Rotation::IDENTITY; self.rig.skeleton.joints.len()];
        self.pose(posture, &mut local);
        let positions = self.rig.skeleton.positions(self.root(posture), &local);
        TorsoPosition { neck: positions[self.rig.neck], turn: self.rig.skeleton.world(&local)[self.rig.chest] }
    }
}
