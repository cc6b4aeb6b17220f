//! Rendering of the figure: a grey mannequin in a marker suit on a plain background, one colour per joint.

use super::camera::DemoCamera;
use super::figure::DrawnFigure;
use super::palette::{COLOURS, N_BODY_MARKERS, N_FINGER_MARKERS};
use orator_base::math::vec3::{Vec3, add, norm, scale, sub};
use orator_base::types::image::Image;
use orator_base::types::skeleton::{L_ELBOW, L_HAND, L_SHOULDER, L_WRIST, NECK, R_ELBOW, R_HAND, R_SHOULDER, R_WRIST};
use orator_media::opencv::draw;

const GROUND: [u8; 3] = [232, 234, 238];
const FLOOR: [u8; 3] = [219, 222, 228];
const OUTLINE: [u8; 3] = [88, 92, 102];
const LEGS: [u8; 3] = [112, 118, 132];
const TORSO: [u8; 3] = [124, 131, 146];
const LIMB: [u8; 3] = [142, 149, 163];
const HAND: [u8; 3] = [168, 171, 178];
const HEAD: [u8; 3] = [186, 187, 191];
const RIM: [u8; 3] = [118, 121, 127];
const MOUTH: [u8; 3] = [84, 84, 90];

/// Marker radii in metres.
const BODY_MARKER: f64 = 0.02;
const FACE_MARKER: f64 = 0.0145;
const FINGER_MARKER: f64 = 0.0095;

/// Draws the figure; `mouth` is the opening of the mouth, 0..1.
pub fn picture(figure: &DrawnFigure, camera: &DemoCamera, mouth: f64) -> anyhow::Result<Image> {
    let mut canvas = Canvas { image: Image::filled(camera.width, camera.height, GROUND), camera };
    canvas.floor()?;
    canvas.torso(figure)?;
    canvas.head(figure, mouth)?;
    let mut arms = [(L_SHOULDER, L_HAND), (R_SHOULDER, R_HAND)];
    arms.sort_by(|a, b| canvas.depth(figure.joints[b.0 + 2]).total_cmp(&canvas.depth(figure.joints[a.0 + 2])));
    for (shoulder, hand) in arms {
        canvas.arm(figure, shoulder)?;
        canvas.hand(figure, hand)?;
    }
    canvas.markers(figure)?;
    Ok(canvas.image)
}

/// The 13 drawn points of COCO-17, in its order.
pub fn coco(figure: &DrawnFigure) -> [Vec3; N_BODY_MARKERS] {
    let [nose, l_eye, r_eye, l_ear, r_ear] = figure.head;
    let arm = [L_SHOULDER, R_SHOULDER, L_ELBOW, R_ELBOW, L_WRIST, R_WRIST].map(|joint| figure.joints[joint]);
    let [l_shoulder, r_shoulder, l_elbow, r_elbow, l_wrist, r_wrist] = arm;
    let [l_hip, r_hip] = figure.hips;
    [nose, l_eye, r_eye, l_ear, r_ear, l_shoulder, r_shoulder, l_elbow, r_elbow, l_wrist, r_wrist, l_hip, r_hip]
}

struct Canvas<'a> {
    image: Image,
    camera: &'a DemoCamera,
}

impl Canvas<'_> {
    fn depth(&self, point: Vec3) -> f64 {
        self.camera.to_camera(point)[2]
    }

    fn project(&self, point: Vec3) -> [f32; 2] {
        self.camera.pixel(self.camera.to_camera(point)).map(|v| v as f32)
    }

    fn px(&self, metres: f64, at: Vec3) -> f32 {
        self.camera.px(metres, self.depth(at)) as f32
    }

    fn floor(&mut self) -> anyhow::Result<()> {
        let (w, h) = (self.camera.width as f32, self.camera.height as f32);
        draw::polygon(
            &mut self.image,
            &[[-2.0, 0.8 * h], [w + 2.0, 0.8 * h], [w + 2.0, h + 2.0], [-2.0, h + 2.0]],
            FLOOR,
        )
    }

    /// Draws a chain of limbs with one outline: (start, radius, end, radius) in metres.
    fn limbs(&mut self, parts: &[(Vec3, f64, Vec3, f64)], rgb: [u8; 3]) -> anyhow::Result<()> {
        let line = (self.camera.height as f32 / 400.0).max(1.0);
        for (grow, colour) in [(line, OUTLINE), (0.0, rgb)] {
            for &(from, from_radius, to, to_radius) in parts {
                let radii = [self.px(from_radius, from) + grow, self.px(to_radius, to) + grow];
                let ends = [self.project(from), self.project(to)];
                draw::capsule(&mut self.image, ends[0], radii[0], ends[1], radii[1], colour)?;
            }
        }
        Ok(())
    }

    fn torso(&mut self, figure: &DrawnFigure) -> anyhow::Result<()> {
        let [l_shoulder, r_shoulder] = [L_SHOULDER, R_SHOULDER].map(|joint| figure.joints[joint]);
        let [l_hip, r_hip] = figure.hips;
        let mid = |a: Vec3, b: Vec3| scale(add(a, b), 0.5);
        let (neck, pelvis) = (figure.joints[NECK], mid(l_hip, r_hip));
        let inner = |shoulder: Vec3| add(scale(shoulder, 0.85), scale(neck, 0.15));
        let (l_chest, r_chest) = (inner(l_shoulder), inner(r_shoulder));
        let legs = [l_hip, r_hip].map(|hip| add(hip, scale(sub(pelvis, neck), 1.2)));
        let throat = add(neck, scale(sub(pelvis, neck), -0.12));
        let nape = add(neck, scale(sub(pelvis, neck), -0.26));
        self.limbs(&[(l_hip, 0.085, legs[0], 0.07), (r_hip, 0.085, legs[1], 0.07)], LEGS)?;
        self.limbs(&[(neck, 0.05, nape, 0.045)], HEAD)?;
        self.limbs(
            &[
                (throat, 0.05, l_chest, 0.058),
                (throat, 0.05, r_chest, 0.058),
                (l_chest, 0.058, l_hip, 0.075),
                (r_chest, 0.058, r_hip, 0.075),
                (mid(l_chest, neck), 0.06, mid(l_hip, pelvis), 0.075),
                (mid(r_chest, neck), 0.06, mid(r_hip, pelvis), 0.075),
                (neck, 0.06, pelvis, 0.075),
                (l_hip, 0.075, r_hip, 0.075),
            ],
            TORSO,
        )
    }

    fn head(&mut self, figure: &DrawnFigure, mouth: f64) -> anyhow::Result<()> {
        let (neck, skull) = (figure.joints[NECK], figure.skull);
        let up = sub(skull, neck);
        let up = scale(up, 1.0 / norm(up).max(1e-9));
        let along = |from: Vec3, metres: f64| add(from, scale(up, metres));
        self.limbs(&[(along(skull, 0.03), 0.095, along(skull, -0.052), 0.07)], HEAD)?;
        let below_nose = along(figure.head[0], -0.042);
        let half = scale(sub(figure.head[1], figure.head[2]), 0.32);
        let thick = 0.004 + 0.011 * mouth;
        let (left, right) = (add(below_nose, half), sub(below_nose, half));
        let radius = self.px(thick, below_nose);
        let [l_end, r_end] = [left, right].map(|end| self.project(along(end, 0.006)));
        let middle = self.project(along(below_nose, -0.004));
        for end in [l_end, r_end] {
            draw::capsule(&mut self.image, end, 0.6 * radius, middle, radius, MOUTH)?;
        }
        Ok(())
    }

    fn arm(&mut self, figure: &DrawnFigure, shoulder: usize) -> anyhow::Result<()> {
        let [start, elbow, wrist] = [0, 1, 2].map(|k| figure.joints[shoulder + k]);
        self.limbs(&[(start, 0.05, elbow, 0.04), (elbow, 0.04, wrist, 0.03)], LIMB)
    }

    fn hand(&mut self, figure: &DrawnFigure, hand: usize) -> anyhow::Result<()> {
        let joint = |k: usize| figure.joints[hand + k];
        let mut parts = Vec::with_capacity(20);
        for finger in 0..5 {
            let base = 1 + 4 * finger;
            parts.push((joint(0), 0.024, joint(base), 0.015));
            parts.extend((base..base + 3).map(|k| (joint(k), 0.011, joint(k + 1), 0.01)));
        }
        parts.sort_by(|a, b| self.depth(b.2).total_cmp(&self.depth(a.2)));
        self.limbs(&parts, HAND)
    }

    /// Draws all markers from far to near, each with a grey rim that separates it from its neighbours.
    fn markers(&mut self, figure: &DrawnFigure) -> anyhow::Result<()> {
        let body = coco(figure);
        let mut all: Vec<(Vec3, f64, [u8; 3])> = Vec::with_capacity(N_BODY_MARKERS + 2 * N_FINGER_MARKERS);
        for (k, (&point, &rgb)) in body.iter().zip(COLOURS.iter()).enumerate() {
            all.push((point, if k < 5 { FACE_MARKER } else { BODY_MARKER }, rgb));
        }
        for hand in [L_HAND, R_HAND] {
            let fingers = &figure.joints[hand + 1..=hand + N_FINGER_MARKERS];
            all.extend(fingers.iter().zip(&COLOURS[N_BODY_MARKERS..]).map(|(&p, &rgb)| (p, FINGER_MARKER, rgb)));
        }
        all.sort_by(|a, b| self.depth(b.0).total_cmp(&self.depth(a.0)));
        for (point, metres, rgb) in all {
            let (centre, radius) = (self.project(point), self.px(metres, point));
            draw::circle(&mut self.image, centre, radius + 0.25 * radius.min(6.0), RIM)?;
            draw::circle(&mut self.image, centre, radius - 0.5, rgb)?;
        }
        Ok(())
    }
}
