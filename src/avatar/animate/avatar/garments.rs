//! Garment details over the shirt's field: collar and lapels, modelled point by point, and the colours of the cloth.

use super::appearance::{Appearance, Reflectance, Top, Weave};
use super::body::BodyForm;
use super::jaw::smooth_step;
use super::stance::HIPS;
use super::surface::Surface;
use orator_base::math::vec3::{Vec3, dot, sub};

/// Heights of a jacket's button and of the top of its lapels above the hips, cm.
const BUTTON: f64 = 13.0;
const THROAT: f64 = 53.0;
/// Maximum half width of the opening of a jacket, cm.
const MAX_OPENING: f64 = 6.2;
/// Period of the stripes and of the checks, cm.
const STRIPE: f64 = 10.0;
const CHECK: f64 = 10.0;

/// Half width of a jacket's opening at a height above the hips, cm.
fn opening(y: f64) -> f64 {
    MAX_OPENING * ((y - BUTTON) / (THROAT - BUTTON)).clamp(0.0, 1.0).powf(0.85)
}

/// Width of a lapel at a fraction of its length, cm: widest below the notch, narrow above it.
fn lapel(share: f64) -> f64 {
    if share < 0.74 { 0.6 + 7.6 * share } else { 3.6 }
}

impl BodyForm<'_> {
    /// Point `over` cm above the front of the shirt at (x, y) in the axes of the hips, in the stance.
    fn on_chest(&self, shirt: &dyn Fn(Vec3) -> f64, [x, y]: [f64; 2], over: f64) -> Vec3 {
        let mut z = 22.0;
        for _ in 0..60 {
            let d = shirt(self.stance.at(HIPS, [x, y, z])) / self.stance.scale;
            if d < 1e-3 || z < -8.0 {
                break;
            }
            z -= 0.8 * d;
        }
        self.stance.at(HIPS, [x, y, z + over])
    }

    /// Left and right lapel of a jacket.
    pub fn lapels(&self, shirt: &dyn Fn(Vec3) -> f64) -> Surface {
        let side = |sign: f64| {
            let mut rows: Vec<Vec<Vec3>> = Vec::new();
            for k in 0..=16 {
                let t = f64::from(k) / 16.0;
                let y = BUTTON - 1.0 + t * (THROAT - 2.5 - BUTTON);
                let width = lapel(t);
                let inner = opening(y) - 0.4;
                let place = |share: f64, over: f64| {
                    self.on_chest(shirt, [sign * (inner + share * width), y + 1.2 * share * t], over)
                };
                rows.push(vec![
                    place(0.0, 0.05),
                    place(0.06, 0.55),
                    place(0.5, 0.6),
                    place(0.94, 0.5),
                    place(1.0, -0.1),
                ]);
            }
            if sign < 0.0 {
                rows.iter_mut().for_each(|row| row.reverse());
            }
            Surface::net(&rows)
        };
        let mut both = side(1.0);
        both.extend(side(-1.0));
        both
    }

    /// Folded shirt collar, open in front.
    pub fn collar(&self) -> Surface {
        let neck = self.rig.neck;
        let size = self.appearance.neck.max(0.9) * self.appearance.head[0].max(1.0);
        let mut rows: Vec<Vec<Vec3>> = vec![Vec::new(); 5];
        for k in -18..=18 {
            // 0 is the nape; the ends nearly meet at the throat.
            let share = f64::from(k) / 18.0;
            let (sin, cos) = (share * 172.0_f64.to_radians()).sin_cos();
            let front = (0.5 - 0.5 * cos).powi(2);
            let base = 4.7 - 2.9 * front;
            let point = (share.abs() - 0.72).max(0.0) / 0.28;
            let fold = [
                (5.75, base + 0.5),
                (5.95, base + 3.3 - 0.6 * front),
                (6.35, base + 3.5 - 0.6 * front),
                (6.9, base + 2.2 - 0.8 * front),
                (7.35 + 0.5 * front, base + 0.4 - 2.6 * point),
            ];
            for (row, (radius, y)) in rows.iter_mut().zip(fold) {
                let r = radius * size;
                row.push(self.stance.at(neck, [-sin * r, y, -cos * r - 1.1 + 0.9 * front]));
            }
        }
        rows.reverse();
        Surface::net(&rows)
    }

    /// Colours of the shirt's vertices.
    pub fn cloth(&self, points: &[Vec3], normals: &[Vec3]) -> Vec<Reflectance> {
        let appearance = self.appearance;
        let trunk = self.trunk();
        let sleeves = [0, 1].map(|side| self.sleeve(side));
        let stance = self.stance;
        let colour = |(&at, normal): (&Vec3, &Vec3)| {
            let local = sub(at, stance.positions[HIPS]).map(|v| v / stance.scale);
            if appearance.top == Top::Jacket {
                // Above the lapels the jacket covers the shoulders up to the sides of the neck.
                let narrow = 0.8 * (local[1] - THROAT + 5.0).max(0.0);
                // The colours meet under the lapel, one cell from its outer edge.
                let under = (lapel((local[1] - BUTTON) / (THROAT - BUTTON)) - 2.4).min(0.9);
                let shown =
                    normal[2] > 0.15 && local[1] > BUTTON + 1.0 && local[0].abs() < opening(local[1]) + under - narrow;
                return if shown { appearance.second_colour } else { appearance.top_colour };
            }
            // Coordinates along and around the trunk, or the arm if its sleeve is nearer.
            let on_trunk = trunk.distance(at);
            let arm = (0..2).find(|&side| sleeves[side].distance(at) < on_trunk);
            let [along, around] = arm.map_or([local[1], local[0]], |side| {
                let arm = &self.rig.arms[side];
                let from = sub(at, stance.positions[arm.upper]).map(|v| v / stance.scale);
                [dot(from, stance.direction(arm.upper, arm.forearm)) + 0.5 * STRIPE, from[2]]
            });
            cloth_colour(appearance, along, around)
        };
        points.iter().zip(normals).map(colour).collect()
    }
}

/// Colour of the cloth at a position along and around the body, cm.
fn cloth_colour(appearance: &Appearance, along: f64, around: f64) -> Reflectance {
    let wave = |at: f64, period: f64| smooth_step(1.5 * (at / period * std::f64::consts::TAU).sin());
    let share = match appearance.weave {
        Weave::Plain => 0.0,
        Weave::Stripes => wave(along, STRIPE),
        Weave::Checks => (wave(along, CHECK) + wave(around, CHECK)) / 2.0,
    };
    std::array::from_fn(|k| {
        appearance.top_colour[k] + share as f32 * (appearance.second_colour[k] - appearance.top_colour[k])
    })
}
