//! Shape of the body in the stance: shirt, bare arms, trousers or skirt, shoes (hands are in `hand`). Lengths are cm
//! for a body of 1.78 m, in the axes of the joint in question (x to its left, y up, z forward).

use super::appearance::{Appearance, Top};
use super::field::{Form, RoundCone, bounding_box, smooth_union};
use super::stance::{HIPS, Stance};
use crate::animate::rig::rig::{Rig, RigArm};
use orator_base::math::vec3::{Vec3, add, dot, norm, scale, sub, unit};

/// Half of the reference shoulder width, cm.
const HALF_SHOULDERS: f64 = 16.5;
/// Distance of the sleeve's end from the wrist, and its radius there, cm, for a hand of size 1.
const SLEEVE_GAP: f64 = 1.9;
const SLEEVE_RADIUS: f64 = 3.05;

/// Shapes of a rig in its stance.
pub struct BodyForm<'a> {
    pub rig: &'a Rig,
    pub stance: &'a Stance,
    /// Shoulder width relative to the reference body.
    shoulder_scale: f64,
    /// Hand sizes relative to the reference hand.
    hand_sizes: [f64; 2],
    pub appearance: &'a Appearance,
}

impl<'a> BodyForm<'a> {
    pub fn new(rig: &'a Rig, stance: &'a Stance, hand_sizes: [f64; 2], appearance: &'a Appearance) -> Self {
        let half = |arm: &RigArm| norm(rig.skeleton.joints[arm.upper].offset) / 2.0;
        let half: f64 = rig.arms.iter().map(half).sum();
        let shoulder_scale = (half / HALF_SHOULDERS / stance.scale).clamp(0.75, 1.3);
        Self { rig, stance, shoulder_scale, hand_sizes, appearance }
    }

    /// Tapered limb between two points in the axes of `joint`, cm of the reference body.
    pub fn limb(&self, joint: usize, ends: [Vec3; 2], radii: [f64; 2]) -> RoundCone {
        RoundCone::new(ends.map(|end| self.stance.at(joint, end)), radii.map(|r| r * self.stance.scale))
    }

    pub fn cm(&self, cm: f64) -> f64 {
        cm * self.stance.scale
    }

    /// The trunk of the shirt without its sleeves.
    pub fn trunk(&self) -> Form {
        let (hips, neck, appearance) = (HIPS, self.rig.neck, self.appearance);
        let girth = appearance.trunk;
        let wide = |x: f64| x * self.shoulder_scale;
        // A jacket is worn over a shirt, so it is wider.
        let cloth = if appearance.top == Top::Jacket { 0.6 } else { 0.0 };
        let across = |y: f64, x: f64, z: f64, r: f64, girth: f64| {
            let (x, r) = (x * girth, r * girth + cloth);
            self.limb(hips, [[-x, y, z], [x, y, z]], [r, r])
        };
        let (waist, seat) = (girth * appearance.waist, girth * appearance.hips);
        let mut form = Form::default()
            .with(across(-4.0, 6.0, -0.4, 9.9, seat), 0.0)
            .with(across(-9.0, 7.4, -0.4, 9.9, seat), self.cm(4.0))
            .with(across(9.0, wide(5.6), 0.3, 9.3, waist), self.cm(13.0))
            .with(across(28.0, wide(5.4), 0.5, 9.9, girth), self.cm(12.0))
            .with(across(39.0, wide(6.4), -0.4, 8.8, 0.6 + 0.4 * girth), self.cm(8.0));
        if appearance.bust > 0.0 {
            for side in [1.0, -1.0] {
                let at = [side * wide(6.4), 29.5, 4.6 + 2.2 * appearance.bust];
                form = form.with(self.limb(hips, [at, at], [5.2 * girth + cloth; 2]), self.cm(5.0));
            }
        }
        for side in [1.0, -1.0] {
            let ends = [[side * 2.8, 4.8, -1.7], [side * wide(14.0), -1.2, -0.8]];
            form = form.with(self.limb(neck, ends, [4.6 + cloth, 4.1 + cloth]), self.cm(6.0));
        }
        let [low, high] = [7.2, 6.2].map(|r| r * appearance.neck.max(0.9) * appearance.head[0].max(1.0) + 0.5 * cloth);
        form.with(self.limb(neck, [[0.0, -4.0, -1.8], [0.0, 8.0, -0.4]], [low, high]), self.cm(4.0))
    }

    /// One sleeve, which ends at the wrist or above the elbow.
    pub fn sleeve(&self, side: usize) -> Form {
        let arm = &self.rig.arms[side];
        let out = arm.sign;
        let (upper, forearm) = (self.length(arm.upper, arm.forearm), self.length(arm.forearm, arm.hand));
        let cloth = if self.appearance.top == Top::Jacket { 0.45 } else { 0.0 };
        let wide = |r: f64| r * self.appearance.limbs + cloth;
        let on_upper = |from: Vec3, to: Vec3, [a, b]: [f64; 2]| self.limb(arm.upper, [from, to], [wide(a), wide(b)]);
        if self.appearance.top == Top::ShortSleeves {
            let end = self.stance.at(arm.upper, [out * 0.56 * upper, 0.0, 0.0]);
            return Form::default()
                .with(on_upper([out * 0.6, -0.3, 0.0], [out * 0.75 * upper, 0.0, 0.0], [4.6, 4.9]), 0.0)
                .with(on_upper([out * 3.0, 0.0, 0.0], [out * 0.45 * upper, 0.1, 0.0], [4.8, 4.8]), self.cm(3.0))
                .cut(end, self.stance.direction(arm.upper, arm.forearm), self.cm(1.0));
        }
        let end = self.sleeve_end(side);
        let wrist = SLEEVE_RADIUS * self.hand_sizes[side] / self.stance.scale + cloth;
        let on_forearm = |from: Vec3, to: Vec3, radii: [f64; 2]| self.limb(arm.forearm, [from, to], radii);
        Form::default()
            .with(on_upper([out * 0.6, -0.3, 0.0], [out * upper, 0.0, 0.0], [4.5, 3.9]), 0.0)
            .with(on_upper([out * 3.0, 0.0, 0.0], [out * 0.45 * upper, 0.1, 0.0], [4.6, 4.2]), self.cm(3.0))
            .with(on_forearm([0.0; 3], [out * 0.35 * forearm, 0.0, 0.2], [wide(4.0), wide(4.0)]), self.cm(2.0))
            .with(
                on_forearm([out * 0.3 * forearm, 0.0, 0.2], [out * forearm, 0.0, 0.0], [wide(4.0), wrist]),
                self.cm(2.0),
            )
            .cut(end, self.stance.direction(arm.forearm, arm.hand), self.cm(0.5))
    }

    /// Bare arm from inside the sleeve to the wrist; `None` with long sleeves.
    pub fn bare_arm(&self, side: usize) -> Option<Form> {
        if self.appearance.top != Top::ShortSleeves {
            return None;
        }
        let arm = &self.rig.arms[side];
        let out = arm.sign;
        let (upper, forearm) = (self.length(arm.upper, arm.forearm), self.length(arm.forearm, arm.hand));
        let wide = |radii: [f64; 2]| radii.map(|r| r * self.appearance.limbs);
        let wrist = 2.4 * self.hand_sizes[side] / self.stance.scale;
        let back = self.stance.world[arm.hand].turn([0.0, 1.0, 0.0]);
        let on_upper = |from: Vec3, to: Vec3, radii: [f64; 2]| self.limb(arm.upper, [from, to], wide(radii));
        let on_forearm = |from: Vec3, to: Vec3, radii: [f64; 2]| self.limb(arm.forearm, [from, to], radii);
        let form = Form::default()
            .with(on_upper([out * 0.3 * upper, 0.0, 0.0], [out * upper, 0.0, 0.0], [3.9, 3.35]), 0.0)
            .with(on_upper([out * 0.42 * upper, -0.2, 0.5], [out * 0.7 * upper, -0.2, 0.5], [3.5, 3.2]), self.cm(3.0))
            .with(on_forearm([0.0; 3], [out * 0.28 * forearm, 0.1, 0.3], wide([3.3, 3.6])), self.cm(1.6))
            .with(
                on_forearm(
                    [out * 0.28 * forearm, 0.1, 0.3],
                    [out * 0.95 * forearm, 0.0, 0.0],
                    [wide([3.6; 2])[0], wrist],
                )
                .flattened(back, 0.84),
                self.cm(2.0),
            );
        Some(form)
    }

    /// The cuff at the end of a sleeve.
    pub fn cuff(&self, side: usize) -> Form {
        let arm = &self.rig.arms[side];
        let along = self.stance.direction(arm.forearm, arm.hand);
        let (end, hand) = (self.sleeve_end(side), self.hand_sizes[side]);
        let jacket = self.appearance.top == Top::Jacket;
        // A shirt cuff protrudes from the sleeve of a jacket.
        let (far_by, loose) = if jacket { (0.9, 0.0) } else { (0.25, 0.2) };
        let [near, far] = [-2.6 * hand, far_by * hand].map(|cm| add(end, scale(along, cm)));
        // The sleeve widens towards the elbow.
        let wider = (self.cm(4.0) - SLEEVE_RADIUS * hand).max(0.0) * (2.6 + SLEEVE_GAP) * hand
            / (0.7 * self.cm(self.length(arm.forearm, arm.hand)));
        Form::default()
            .with(
                RoundCone::new(
                    [near, far],
                    [(SLEEVE_RADIUS + loose + 0.12) * hand + wider, (SLEEVE_RADIUS + loose) * hand],
                ),
                0.0,
            )
            .cut(far, along, 0.35 * hand)
            .cut(near, scale(along, -1.0), 0.35 * hand)
    }

    fn sleeve_end(&self, side: usize) -> Vec3 {
        let arm = &self.rig.arms[side];
        let along = self.stance.direction(arm.forearm, arm.hand);
        sub(self.stance.positions[arm.hand], scale(along, SLEEVE_GAP * self.hand_sizes[side]))
    }

    /// Signed distance to the complete shirt.
    pub fn shirt(&self) -> impl Fn(Vec3) -> f64 + Sync + use<'_> {
        let trunk = self.trunk();
        let sleeves = [0, 1].map(|side| self.sleeve(side));
        let collar = self.stance.at(self.rig.neck, [0.0, 5.4, 0.0]);
        // A shirt is worn over trousers but inside a skirt.
        let low = match (self.appearance.skirt, self.appearance.top) {
            (_, Top::Jacket) => -10.0,
            (true, _) => 2.0,
            (false, _) => -7.5,
        };
        let hem = self.stance.at(HIPS, [0.0, low, 0.0]);
        let tilt = unit([0.0, 1.0, 0.42], 0.0).unwrap_or([0.0, 1.0, 0.0]);
        let (armpit, edge) = (self.cm(2.6), self.cm(1.5));
        move |at| {
            let grown =
                sleeves.iter().fold(trunk.distance(at), |d, sleeve| smooth_union(d, sleeve.distance(at), armpit));
            [(collar, tilt), (hem, [0.0, -1.0, 0.0])]
                .into_iter()
                .fold(grown, |d, (point, normal)| -smooth_union(-d, -dot(sub(at, point), normal), edge))
        }
    }

    /// Corners of the bounding box of the shirt.
    pub fn shirt_bounds(&self) -> [Vec3; 2] {
        let sleeves = [0, 1].map(|side| self.sleeve(side).bounds()).into_iter();
        bounding_box(sleeves.chain([self.trunk().bounds()]))
    }

    /// Trousers from the waist to the ankles, or bare legs under a skirt.
    pub fn trousers(&self) -> Form {
        let (hips, appearance) = (HIPS, self.appearance);
        let seat = appearance.trunk * appearance.hips;
        let x = 5.4 * seat;
        let mut form = Form::default().with(self.limb(hips, [[-x, -3.5, -0.5], [x, -3.5, -0.5]], [8.6 * seat; 2]), 0.0);
        // Limits the thighs to the width of narrow hips.
        let girth = appearance.limbs.min(seat + 0.05) * if appearance.skirt { 0.84 } else { 1.0 };
        let narrow = 9.0 * (1.0 - seat).max(0.0);
        for (side, [upper, lower, foot, _]) in [1.0, -1.0].into_iter().zip(self.rig.legs) {
            let knee = self.length(upper, lower);
            let ankle = self.length(lower, foot);
            let wide = |radii: [f64; 2]| radii.map(|r| r * girth);
            let hem = if appearance.skirt { 3.6 } else { 5.2 };
            let (hip, seam) = (-side * narrow, -side * (narrow + 1.5));
            form = form
                .with(self.limb(upper, [[hip, -2.0, 0.0], [0.0, -knee, 0.0]], wide([7.1, 5.8])), self.cm(2.5))
                .with(self.limb(upper, [[seam, -1.0, -2.0], [0.5 * hip, -12.0, -0.5]], wide([7.0, 6.7])), self.cm(3.0))
                .with(self.limb(lower, [[0.0, 0.0, 0.0], [0.0, -ankle, 0.0]], wide([5.9, hem])), self.cm(2.0))
                .with(self.limb(lower, [[0.0, -7.0, -1.6], [0.0, -18.0, -1.2]], wide([5.2, 4.8])), self.cm(4.0));
        }
        let waist = self.stance.at(hips, [0.0, 4.0, 0.0]);
        let ankles = self.stance.at(self.rig.legs[0][2], [0.0, -1.6, 0.0]);
        form.cut(waist, [0.0, 1.0, 0.0], self.cm(0.8)).cut(ankles, [0.0, -1.0, 0.0], self.cm(0.8))
    }

    /// Skirt from the waist to above the knees.
    pub fn skirt(&self) -> Form {
        let (hips, appearance) = (HIPS, self.appearance);
        let seat = appearance.trunk * appearance.hips;
        let long = 0.92 * self.length(self.rig.legs[0][0], self.rig.legs[0][1]);
        let part = |y: f64, x: f64, r: f64| self.limb(hips, [[-x, y, -0.6], [x, y, -0.6]], [r, r]);
        let (waist, knees) = ([0.0, 4.0, 0.0], [0.0, -long, 0.0]);
        Form::default()
            .with(part(-2.0, 5.6 * seat, 8.9 * seat), 0.0)
            .with(part(-10.0, 7.4 * seat, 9.5 * seat), self.cm(8.0))
            .with(part(-24.0, 8.4 * seat, 9.9 * seat), self.cm(10.0))
            .with(part(-long, 9.4 * seat, 10.6 * seat), self.cm(12.0))
            .cut(self.stance.at(hips, waist), [0.0, 1.0, 0.0], self.cm(0.8))
            .cut(self.stance.at(hips, knees), [0.0, -1.0, 0.0], self.cm(1.4))
    }

    pub fn shoe(&self, side: usize) -> Form {
        let foot = self.rig.legs[side][2];
        let out = [0.6, -0.6][side];
        let ground = self.stance.at(foot, [0.0, -8.0, 0.0]);
        Form::default()
            .with(self.limb(foot, [[0.0, 2.0, -0.6], [0.0, -3.5, -1.6]], [4.4, 4.4]), 0.0)
            .with(self.limb(foot, [[0.0, -4.6, -3.6], [out, -5.4, 8.0]], [4.1, 4.3]), self.cm(2.0))
            .with(self.limb(foot, [[0.0, -1.6, 1.0], [out, -5.4, 9.0]], [4.0, 3.7]), self.cm(3.0))
            .with(self.limb(foot, [[out, -6.0, 8.0], [out, -6.6, 15.0]], [4.3, 3.0]), self.cm(3.0))
            .cut(ground, [0.0, -1.0, 0.0], self.cm(1.2))
    }

    /// Distance of two joints, cm of the reference body.
    fn length(&self, from: usize, to: usize) -> f64 {
        norm(scale(sub(self.stance.positions[to], self.stance.positions[from]), 1.0 / self.stance.scale))
    }
}
