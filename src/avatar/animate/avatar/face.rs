//! Facial features: eyes with lids, brows, lips, teeth, and glasses, in the axes of the reference head.

use super::appearance::{Appearance, Reflectance};
use super::head::{EAR, EYE, EYE_RADIUS, HeadForm};
use super::jaw::{MOUTH_HALF, MOUTH_Y, jaw_share, smooth_step};
use super::material::Material;
use super::surface::Surface;
use orator_base::math::vec3::{Vec3, add, scale, sub, unit};

/// Angles from the centre of the eye to the edges of the upper and lower lid and to the corners of the eye, degrees.
const UPPER_LID: f64 = 21.5;
const LOWER_LID: f64 = 17.0;
const CORNER: f64 = 66.0;
/// Thickness of a lid, cm.
const LID: f64 = 0.13;
/// Angles from the centre of the iris to the edges of the pupil and the iris, degrees.
const PUPIL: f64 = 9.0;
const IRIS: f64 = 25.5;

/// A facial feature in the axes of the head.
pub struct Feature {
    pub material: Material,
    pub surface: Surface,
    pub colours: Vec<Reflectance>,
    /// Fraction of the jaw rotation that each vertex follows, 0..1; empty if no vertex moves.
    pub shares: Vec<f64>,
}

impl Feature {
    fn fixed(material: Material, surface: Surface, colours: Vec<Reflectance>) -> Self {
        Self { material, surface, colours, shares: Vec::new() }
    }

    fn mirrored(&self) -> Self {
        let (surface, colours) = (self.surface.clone().mirrored(), self.colours.clone());
        Self { material: self.material, surface, colours, shares: self.shares.clone() }
    }
}

pub fn mix(a: Reflectance, b: Reflectance, share: f64) -> Reflectance {
    std::array::from_fn(|k| a[k] + share as f32 * (b[k] - a[k]))
}

impl HeadForm<'_> {
    /// All features of the face; none for a mannequin's head.
    pub fn features(&self, appearance: &Appearance) -> Vec<Feature> {
        let mut all = Vec::new();
        if !appearance.face {
            return all;
        }
        for left in [eyeball(appearance), lid(appearance, true), lid(appearance, false), self.brow(appearance)] {
            all.push(left.mirrored());
            all.push(left);
        }
        all.extend([self.lip(appearance, true), self.lip(appearance, false), self.teeth()]);
        all.extend(appearance.glasses.map(|colour| self.glasses(colour)));
        all
    }

    fn brow(&self, appearance: &Appearance) -> Feature {
        let columns = (0..=10).map(|k| f64::from(k) / 10.0);
        let mut rows = vec![Vec::new(); 4];
        for t in columns {
            let middle = 12.45 + 0.75 * (t * 2.0).sin() - 0.75 * t * t;
            let half = appearance.brows * (0.34 - 0.22 * t) * (1.0 - (1.0 - (8.0 * t).min(1.0)).powi(2) * 0.5);
            let x = 1.15 + 4.15 * t;
            for (row, (up, out)) in rows.iter_mut().zip([(-1.0, -0.12), (-0.45, 0.16), (0.45, 0.16), (1.0, -0.12)]) {
                let y = middle + up * half;
                row.push([x, y, self.front(x, y) + out]);
            }
        }
        let surface = Surface::net(&rows);
        let colour = mix(appearance.hair_colour.map(|v| 0.7 * v), appearance.skin, 0.12);
        let colours = vec![colour; surface.points.len()];
        Feature::fixed(Material::Hair, surface, colours)
    }

    /// Upper or lower lip, from its border to its inner edge and slightly inwards.
    fn lip(&self, appearance: &Appearance, upper: bool) -> Feature {
        let side = if upper { 1.0 } else { -1.0 };
        // Position from the inner edge (0) to the border (1), height over the skin (cm), strength of the lip colour.
        let across = [
            (-0.2, -0.55, 1.0),
            (0.0, -0.02, 1.0),
            (0.18, 0.30, 1.0),
            (0.5, 0.36, 1.0),
            (0.84, 0.13, 0.9),
            (1.08, -0.12, 0.25),
        ];
        let mut rows: Vec<Vec<Vec3>> = Vec::new();
        let (mut colours, mut shares) = (Vec::new(), Vec::new());
        for (way, out, red) in across {
            let mut row = Vec::new();
            for k in -10..=10 {
                let u = f64::from(k) / 10.0;
                let round = (1.0 - u * u).max(0.0);
                let height = if upper {
                    0.78 * round.powf(0.62) - 0.13 * (-(u / 0.14).powi(2)).exp()
                } else {
                    0.98 * round.powf(0.72)
                };
                let x = MOUTH_HALF * u;
                let edge = MOUTH_Y + 0.07 * (1.0 - round) - 0.05 * (-(u / 0.3).powi(2)).exp();
                let y = edge + side * appearance.lips * height * way;
                let full = appearance.lips * round.powf(0.4);
                row.push([x, y, self.front(x, y) + if out > 0.0 { out * full } else { out * (0.3 + 0.7 * round) }]);
                colours.push(mix(appearance.skin, appearance.lip_colour, red * (0.4 + 0.6 * round.powf(0.3))));
                let inner = if upper { 0.5 * u.powi(4) } else { 1.0 - 0.5 * u.powi(4) };
                let border = jaw_share([x, y, 9.5]);
                let to_border = way.clamp(0.0, 1.0);
                shares.push(inner + to_border * to_border * (border - inner));
            }
            rows.push(row);
        }
        if !upper {
            rows.reverse();
            let width = rows[0].len();
            colours = colours.chunks(width).rev().flatten().copied().collect();
            shares = shares.chunks(width).rev().flatten().copied().collect();
        }
        Feature { material: Material::Face, surface: Surface::net(&rows), colours, shares }
    }

    /// Upper row of teeth.
    fn teeth(&self) -> Feature {
        let row = |y: f64, back: f64| -> Vec<Vec3> {
            let columns = (-6..=6).map(|k| 1.75 * f64::from(k) / 6.0);
            columns.map(|x| [x, y, self.front(x, MOUTH_Y) - 0.62 - 0.1 * x * x - back]).collect()
        };
        let surface = Surface::net(&[row(MOUTH_Y - 0.3, 0.12), row(MOUTH_Y - 0.22, 0.0), row(MOUTH_Y + 0.75, 0.0)]);
        let colours = vec![[0.62, 0.58, 0.50]; surface.points.len()];
        Feature::fixed(Material::Eyes, surface, colours)
    }

    /// Frames of glasses: two rims, the bridge between them, and the temples.
    fn glasses(&self, colour: Reflectance) -> Feature {
        let front = self.front(0.0, 12.2).max(self.front(3.0, 12.4)).max(EYE[2] + EYE_RADIUS + 0.35) + 0.35;
        let bent = |x: f64| front - 0.03 * x * x;
        let rim: Vec<Vec3> = (0..28)
            .map(|k| {
                let (sin, cos) = (f64::from(k) / 28.0 * std::f64::consts::TAU).sin_cos();
                let round = |v: f64| v.signum() * v.abs().powf(0.7);
                let x = EYE[0] + 0.15 + 2.55 * round(cos);
                [x, EYE[1] - 0.25 + 1.95 * round(sin), bent(x)]
            })
            .collect();
        let mut surface = Surface::tube(&rim, true, 0.17, 6);
        let hinge = EYE[0] + 2.6;
        let temple = [[hinge, 11.1, bent(hinge)], [8.0, 11.2, 5.2], [8.2, 11.2, 0.5], [EAR[0] + 0.3, 10.6, -1.4]];
        surface.extend(Surface::tube(&temple, false, 0.16, 5));
        surface.extend(surface.clone().mirrored());
        let bridge: Vec<Vec3> =
            (-4..=4).map(|k| f64::from(k) * 0.24).map(|x| [x, 11.0 - 0.25 * x * x, bent(x) + 0.1]).collect();
        surface.extend(Surface::tube(&bridge, false, 0.16, 5));
        let colours = vec![colour; surface.points.len()];
        Feature::fixed(Material::Frames, surface, colours)
    }
}

/// Left eyeball, with rings for pupil, iris and white around its axis.
fn eyeball(appearance: &Appearance) -> Feature {
    let (black, white) = ([0.004; 3], [0.66, 0.63, 0.60]);
    let rim = appearance.iris.map(|v| 0.35 * v);
    let rings = [
        (0.5, black),
        (PUPIL, black),
        (PUPIL + 0.8, appearance.iris),
        (IRIS - 4.0, appearance.iris),
        (IRIS, rim),
        (IRIS + 1.5, white),
        (45.0, white),
        (68.0, mix(white, appearance.skin, 0.3)),
        (85.0, mix(white, appearance.skin, 0.4)),
    ];
    let rows: Vec<Vec<Vec3>> = rings
        .iter()
        .map(|(degrees, _)| {
            let (sin, cos) = f64::to_radians(*degrees).sin_cos();
            let around = (0..=18).map(|k| (f64::from(k) / 18.0 * std::f64::consts::TAU).sin_cos());
            // The order is clockwise from the front: along the row, then outwards, then to the front.
            around.map(|(y, x)| add(EYE, scale([-sin * x, sin * y, cos], EYE_RADIUS))).collect()
        })
        .collect();
    let colours = rings.iter().flat_map(|(_, colour)| [*colour; 19]).collect();
    Feature::fixed(Material::Eyes, Surface::net(&rows), colours)
}

/// Upper or lower lid of the left eye: part of a shell around the eyeball, with its edge.
fn lid(appearance: &Appearance, upper: bool) -> Feature {
    let side = if upper { 1.0 } else { -1.0 };
    let lash = if upper {
        mix(appearance.hair_colour.map(|v| 0.5 * v), [0.01; 3], 0.6)
    } else {
        appearance.skin.map(|v| 0.5 * v)
    };
    let fold = appearance.skin.map(|v| 0.86 * v);
    let moist = mix(appearance.skin, [0.45, 0.14, 0.12], 0.5);
    // Angle beyond the edge (degrees), height over the eyeball (cm), colour.
    let rows = [
        (0.0, -0.02, moist),
        (0.0, LID, lash),
        (if upper { 5.0 } else { 1.5 }, LID + 0.02, lash),
        (if upper { 6.0 } else { 2.5 }, LID, fold),
        (20.0, LID, appearance.skin),
        (40.0, LID - 0.06, appearance.skin),
        (62.0, LID - 0.2, appearance.skin),
    ];
    let mut colours = Vec::new();
    let mut net: Vec<Vec<Vec3>> = Vec::new();
    for (beyond, high, colour) in rows {
        let mut row = Vec::new();
        for k in -12..=12 {
            let u = f64::from(k) / 10.0;
            let turn = CORNER * u;
            // The highest point of the upper lid is nearer to the nose, the lowest of the lower lid farther from it.
            let skewed = (u + side * 0.12 * (1.0 - u * u)).clamp(-1.0, 1.0);
            let open = (1.0 - skewed * skewed).max(0.0).powf(0.72) * if upper { UPPER_LID } else { LOWER_LID };
            // The outer corner is slightly higher.
            let tilt = 2.5 * u;
            let up = side * (open + beyond) + tilt;
            let ((sin_x, cos_x), (sin_y, cos_y)) = (turn.to_radians().sin_cos(), up.to_radians().sin_cos());
            let radius = EYE_RADIUS + high;
            row.push(add(EYE, scale([sin_x * cos_y, sin_y, cos_x * cos_y], radius)));
            colours.push(colour);
        }
        net.push(row);
    }
    if !upper {
        net.reverse();
        let width = net[0].len();
        colours = colours.chunks(width).rev().flatten().copied().collect();
    }
    let mut surface = Surface::net(&net);
    // Normals of the lid approach those of the skin where the two meet.
    for (at, normal) in surface.points.iter().zip(&mut surface.normals) {
        let from = scale(sub(*at, EYE), 1.0 / EYE_RADIUS);
        let skin = [0.3, 0.0, 0.95];
        let share = 0.75 * smooth_step((from[1].abs() - 0.55) / 0.25);
        *normal = unit(add(scale(*normal, 1.0 - share), scale(skin, share)), 1e-9).unwrap_or(skin);
    }
    Feature::fixed(Material::Face, surface, colours)
}

impl HeadForm<'_> {
    /// Skin colour of the head at a point.
    pub fn complexion(&self, at: Vec3, appearance: &Appearance) -> Reflectance {
        if !appearance.face {
            return appearance.skin;
        }
        if self.in_mouth(at) {
            return [0.055, 0.012, 0.012];
        }
        let [x, y, z] = [at[0].abs(), at[1], at[2]];
        let mut colour = appearance.skin;
        // Cheeks and the tip of the nose are redder.
        let blood = smooth_step(1.0 - ((x - 4.2).hypot(y - 7.0) / 2.0)) * smooth_step((z - 5.0) / 2.0);
        let tip = smooth_step(1.0 - x.hypot(y - 7.4) / 1.1) * smooth_step((z - 10.3) / 0.5);
        let red = [0.95 * colour[0], 0.74 * colour[1], 0.72 * colour[2]];
        colour = mix(colour, red, 0.55 * (blood + tip).min(1.0));
        // Nostrils are dark.
        let nostril =
            smooth_step(1.6 - ((x - 0.62 * appearance.nose) / 0.24).hypot((y - 6.75) / 0.35).hypot((z - 10.0) / 0.6));
        colour = mix(colour, appearance.skin.map(|v| 0.25 * v), 0.9 * nostril);
        mix(colour, mix(appearance.hair_colour, appearance.skin, 0.15), beard([x, y, z], appearance))
    }
}

/// Density of the beard at a point with x >= 0.
fn beard([x, y, z]: Vec3, appearance: &Appearance) -> f64 {
    if appearance.beard <= 0.0 {
        return 0.0;
    }
    let cheek = 5.0 + 0.6 * (x - 2.6).max(0.0) + 0.5 * (4.0 - z).max(0.0);
    let jaw = smooth_step((cheek - y) / 0.5) * smooth_step((x - 2.2) / 0.5);
    let chin = smooth_step((MOUTH_Y - 1.1 - y) / 0.3);
    let moustache =
        smooth_step((y - MOUTH_Y - 0.55) / 0.2) * smooth_step((6.0 - y) / 0.3) * smooth_step((2.9 - x) / 0.4);
    let front = smooth_step((z - 1.0) / 1.4) * smooth_step((y + 1.4) / 1.2);
    appearance.beard * (jaw.max(chin).max(moustache) * front)
}
