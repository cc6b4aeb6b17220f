//! Shape of head, ears and hair. Lengths are cm for a head of 21.5 cm from chin to crown, in the axes of its joint (x
//! to its left, y up, z forward); `position` maps them into the stance at the size of the actual head.

use super::appearance::{Appearance, Hairstyle};
use super::field::{Form, RoundCone, smooth_union};
use super::jaw::{MOUTH_Y, smooth_step};
use super::stance::Stance;
use super::surface::Surface;
use crate::animate::rig::rig::Rig;
use orator_base::math::vec3::{Vec3, add, dot, norm, sub, unit};

/// Centre of the left eyeball and its radius.
pub const EYE: Vec3 = [3.15, 10.5, 7.15];
pub const EYE_RADIUS: f64 = 1.36;
/// Centre of the left ear.
pub const EAR: Vec3 = [7.75, 9.5, -0.4];
/// Cell size at the centre of the face; that centre, and the radius within which cells hardly grow.
const CELL: f64 = 0.4;
const FOCUS: (Vec3, f64) = ([0.0, 7.0, 8.8], 4.8);
/// Head size of the plain avatar relative to the reference head, at equal trunk length.
const HEAD_SCALE: f64 = 1.05;
const EAR_CELL: f64 = 0.38;
const HAIR_CELL: f64 = 1.0;

/// Shape of one head.
pub struct HeadForm<'a> {
    stance: &'a Stance,
    joint: usize,
    /// Width, height and depth relative to the reference head.
    size: Vec3,
    skull: Form,
    /// Skull with facial shape; defined for x >= 0 and mirrored.
    face: Form,
    neck: RoundCone,
    appearance: &'a Appearance,
}

fn cone(a: Vec3, b: Vec3, radii: [f64; 2]) -> RoundCone {
    RoundCone::new([a, b], radii)
}

/// Subtracts `hole` from `d`, with the edge rounded within `blend` cm.
fn smooth_difference(d: f64, hole: f64, blend: f64) -> f64 {
    -smooth_union(-d, hole, blend)
}

impl<'a> HeadForm<'a> {
    pub fn new(rig: &Rig, stance: &'a Stance, appearance: &'a Appearance) -> Self {
        let joint = rig.head;
        let size = appearance.head.map(|v| v * HEAD_SCALE);
        let down = sub(stance.positions[rig.neck], stance.positions[joint]);
        let neck_y = down[1] / stance.scale / size[1];
        let (jaw, nose) = (appearance.jaw, appearance.nose);
        let skull = Form::default()
            .with(cone([0.0, 13.4, -1.9], [0.0, 13.6, 1.0], [7.6, 7.5]), 0.0)
            .with(cone([0.0, 10.6, 1.6], [0.0, 5.9, 2.6], [7.0, 5.9]), 4.5)
            .with(cone([0.0, 4.9, 4.2], [0.0, 3.2, 5.0], [4.3 * jaw, 3.1]), 3.5);
        let chin = 1.15 * jaw;
        let face = skull
            .clone()
            // Jaw line, chin and mouth area.
            .with(cone([4.3 * jaw, 4.2, 0.8], [2.6 * jaw, 1.9, 5.6], [1.5, 1.5]), 2.5)
            .with(cone([-chin, 1.35, 7.0], [chin, 1.35, 7.0], [1.45, 1.45]), 1.8)
            .with(cone([0.0, 4.9, 4.9], [0.0, 4.9, 5.1], [4.2, 4.2]), 2.0)
            // Cheekbone, cheek and brow.
            .with(cone([4.5, 8.0, 5.2], [6.0, 8.6, 2.4], [1.9, 1.5]), 2.2)
            .with(cone([3.4, 6.0, 5.6], [3.4, 6.0, 5.6], [2.4, 2.4]), 2.5)
            .with(cone([0.7, 12.3, 7.65], [4.9, 12.4, 5.9], [1.25, 1.2]), 1.6)
            // Bridge, tip and wing of the nose.
            .with(cone([0.0, 11.3, 8.3], [0.0, 8.2, 9.9 + 0.3 * nose], [0.62, 0.85 * nose]), 1.1)
            .with(cone([0.0, 7.75, 10.5 * 0.5 + 5.25 * nose], [0.0, 7.4, 9.6], [0.92 * nose, 0.9 * nose]), 0.7)
            .with(cone([0.95 * nose, 7.15, 9.6], [1.2 * nose, 7.2, 9.0], [0.72 * nose, 0.6]), 0.6);
        let girth = appearance.neck;
        let neck = cone([0.0, neck_y - 1.0, -1.7], [0.0, 3.5, -0.9], [5.7 * girth, 5.0 * girth]);
        Self { stance, joint, size, skull, face, neck, appearance }
    }

    /// Maps a point of the reference head into the stance.
    pub fn position(&self, at: Vec3) -> Vec3 {
        self.stance.at(self.joint, [0, 1, 2].map(|k| at[k] * self.size[k]))
    }

    /// Scales a displacement of the reference head to cm; rotation and translation are not applied.
    pub fn scaled(&self, at: Vec3) -> Vec3 {
        [0, 1, 2].map(|k| at[k] * self.size[k] * self.stance.scale)
    }

    /// Maps a surface of the reference head into the stance.
    pub fn placed(&self, mut surface: Surface) -> Surface {
        surface.points.iter_mut().for_each(|at| *at = self.position(*at));
        for normal in &mut surface.normals {
            let turned = [0, 1, 2].map(|k| normal[k] / self.size[k]);
            *normal = self.stance.world[self.joint].turn(unit(turned, 1e-9).unwrap_or(*normal));
        }
        surface
    }

    /// Signed distance to head and neck with the mouth closed and without eye sockets.
    fn without_cavities(&self, [x, y, z]: Vec3) -> f64 {
        let at = [x.abs(), y, z];
        smooth_union(self.face.distance(at), self.neck.distance(at), 2.2)
    }

    /// Signed distance to head and neck, with eye sockets and the mouth cavity if there is a face.
    fn skin(&self, [x, y, z]: Vec3) -> f64 {
        let at = [x.abs(), y, z];
        if !self.appearance.face {
            return self.without_cavities(at);
        }
        let [ex, ey, _] = EYE;
        let socket = cone([ex - 0.45, ey + 0.15, 9.6], [ex + 0.5, ey + 0.25, 9.4], [1.65, 1.65])
            .flattened([0.0, 1.0, 0.0], 0.75);
        let d = smooth_difference(self.without_cavities(at), socket.distance(at), 1.0);
        smooth_difference(d, mouth_cavity(at), 0.2)
    }

    /// Frontmost z of the face at (x, y), without eye sockets and mouth cavity.
    pub fn front(&self, x: f64, y: f64) -> f64 {
        let mut z = 14.0;
        for _ in 0..60 {
            let d = self.without_cavities([x, y, z]);
            if d < 1e-4 || z < 0.0 {
                break;
            }
            z -= 0.8 * d;
        }
        z
    }

    /// Surface of head and neck, in the axes of the reference head.
    pub fn skin_surface(&self) -> Surface {
        let neck = self.neck.bounds()[0][1].min(-6.0);
        let bounds = [[-8.6, neck, -10.2], [8.6, 22.0, 13.2]];
        Surface::focused(&|at| self.skin(at), bounds, CELL, FOCUS)
    }

    /// Surface of the left ear, in the axes of the reference head.
    pub fn ear_surface(&self) -> Surface {
        let [x, y, z] = EAR;
        let out = unit([0.86, 0.0, -0.5], 0.0).unwrap_or([1.0, 0.0, 0.0]);
        let form = Form::default()
            .with(cone([x + 0.25, y + 1.7, z - 0.5], [x, y - 0.8, z], [1.65, 1.15]).flattened(out, 0.42), 0.0)
            .with(
                cone([x - 0.15, y - 1.6, z + 0.35], [x - 0.15, y - 2.1, z + 0.5], [0.8, 0.65]).flattened(out, 0.5),
                0.8,
            );
        let shell = cone([x + 0.75, y + 1.1, z + 0.1], [x + 0.6, y - 0.6, z + 0.35], [0.8, 0.6]).flattened(out, 0.55);
        let field = |at: Vec3| smooth_difference(form.distance(at), shell.distance(at), 0.35);
        let blended = |at: Vec3| smooth_union(field(at), self.without_cavities(at), 0.7);
        Surface::from_field(&field, form.bounds(), EAR_CELL).with_normals_of(&blended, 0.3 * EAR_CELL)
    }

    /// Surface of the hair, in the axes of the reference head; `None` if bald.
    pub fn hair_surface(&self) -> Option<Surface> {
        let style = self.appearance.hair;
        if style == Hairstyle::Bald {
            return None;
        }
        let mut locks = Form::default();
        let bun = Form::default()
            .with(cone([0.0, 14.6, -8.6], [0.0, 15.0, -9.4], [2.2, 2.4]), 0.0)
            .with(cone([0.0, 14.8, -11.0], [0.0, 15.2, -11.4], [2.7, 2.6]), 1.0);
        if style == Hairstyle::Long {
            locks = locks.with(cone([0.0, 10.0, -6.6], [0.0, -9.0, -5.2], [3.6, 2.6]), 0.0);
            for side in [1.0, -1.0] {
                locks = locks
                    .with(cone([side * 7.2, 13.0, -2.6], [side * 7.6, 3.0, -2.4], [1.7, 2.1]), 3.0)
                    .with(cone([side * 7.6, 3.0, -2.4], [side * 7.0, -8.5, -1.6], [2.2, 1.9]), 2.0)
                    .with(cone([side * 4.2, 7.0, -6.6], [side * 4.0, -9.0, -5.4], [3.0, 2.5]), 4.0);
            }
        }
        let thick = match style {
            Hairstyle::Long => 0.95,
            Hairstyle::Tied => 0.6,
            _ => 0.75,
        };
        let (volume, fringe, parting) = (self.appearance.hair_volume, self.appearance.fringe, self.appearance.parting);
        let field = |at: Vec3| {
            let [x, y, z] = at;
            // Hair is thicker on the crown and thin at the temples and the nape.
            let full = thick * volume * (0.45 + 0.75 * smooth_step((y - 13.0) / 6.0));
            let strand = 0.10 * (1.9 * x + 0.6 * y + (0.5 * z).sin()).sin() * smooth_step((y - 9.0) / 6.0);
            let mut d = self.skull.distance([x.abs(), y, z]) - full - strand;
            // Keeps the face free of hair, then the nape and the ears.
            let low = fringe - 0.9 * parting * (x / 2.5).tanh();
            let face = norm([x / 13.5, (y - 8.2 + low) / 9.6, (z - 12.2) / 11.2]) - 1.0;
            d = smooth_difference(d, 8.0 * face, 0.5);
            let nape = dot(sub(at, [0.0, 5.0, -5.0]), [0.0, 0.97, -0.24]);
            d = -smooth_union(-d, nape, 0.6);
            let ear = sub([x.abs(), y, z], add(EAR, [0.4, -0.3, 0.5]));
            d = smooth_difference(d, norm([ear[0] / 1.4, ear[1] / 1.35, ear[2]]) - 1.75, 0.4);
            match style {
                Hairstyle::Long => smooth_union(d, locks.distance(at) - 0.8 * strand, 1.5),
                Hairstyle::Tied => smooth_union(d, bun.distance(at), 0.8),
                _ => d,
            }
        };
        let (low, cell) = if style == Hairstyle::Long { (-12.5, 1.2 * HAIR_CELL) } else { (2.0, HAIR_CELL) };
        let bounds = symmetric_box([[-11.0, low, -15.0], [11.0, 24.0, 11.0]], cell);
        Some(Surface::from_field(&field, bounds, cell).with_normals_of(&field, 0.5 * cell))
    }

    /// Whether a point of the skin is in the mouth cavity.
    pub fn in_mouth(&self, [x, y, z]: Vec3) -> bool {
        self.without_cavities([x, y, z]) < -0.12 && mouth_cavity([x, y, z]) < 0.25 && y < MOUTH_Y + 1.0
    }
}

/// A box that gives a grid symmetric about x = 0.
fn symmetric_box([mut low, mut high]: [Vec3; 2], cell: f64) -> [Vec3; 2] {
    high[0] = (high[0] / cell).ceil() * cell;
    low[0] = -high[0];
    [low, high]
}

/// Signed distance to the mouth cavity, which the lips cover.
fn mouth_cavity(at: Vec3) -> f64 {
    let deep = cone([-1.1, MOUTH_Y, 8.6], [1.1, MOUTH_Y, 8.6], [1.3, 1.3]);
    deep.flattened([0.0, 1.0, 0.0], 0.42).distance(at)
}
