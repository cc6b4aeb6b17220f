//! Lighting of a scene: the light that a vertex reflects towards the camera.

use orator_base::math::vec3::{Vec3, any_across, cross, unit};

/// A directional key light, hemispherical ambient light, and a rim light. Colours are linear RGB.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Light {
    /// Unit vector towards the key light, in world axes.
    pub to_key: [f32; 3],
    pub key: [f32; 3],
    /// Ambient light from above and from below.
    pub sky: [f32; 3],
    pub ground: [f32; 3],
    /// Light from behind that brightens outlines.
    pub rim: [f32; 3],
}

impl Light {
    /// Studio light with the key light in direction `to_key` (any length).
    pub fn studio(to_key: Vec3) -> Self {
        let to_key = unit(to_key, 1e-9).unwrap_or([0.0, 1.0, 0.0]).map(|v| v as f32);
        let (key, sky, ground) = ([1.02, 0.97, 0.90], [0.34, 0.36, 0.40], [0.15, 0.14, 0.13]);
        Self { to_key, key, sky, ground, rim: [0.22, 0.24, 0.27] }
    }

    /// Axes of the shadow map: two unit vectors perpendicular to the key light and the direction in which it shines.
    pub fn axes(&self) -> [[f32; 3]; 3] {
        let to_key = self.to_key.map(f64::from);
        let across = any_across(to_key);
        [across, cross(to_key, across), to_key.map(|v| -v)].map(|axis| axis.map(|v| v as f32))
    }

    /// Linear RGB that a surface reflects without the key light, and the part that the unshadowed key light adds.
    #[inline(always)]
    pub fn on(&self, normal: [f32; 3], to_viewer: [f32; 3], colour: [f32; 3], gloss: f32) -> [[f32; 3]; 2] {
        let lambert = ((dot(normal, self.to_key) + WRAP) / (1.0 + WRAP)).max(0.0);
        let up = 0.5 + 0.5 * normal[1];
        let facing = dot(normal, to_viewer).max(0.0);
        let edge = (1.0 - facing) * (1.0 - facing);
        let rim = edge * edge * up * 0.5;
        let half =
            direction([self.to_key[0] + to_viewer[0], self.to_key[1] + to_viewer[1], self.to_key[2] + to_viewer[2]]);
        let mut shine = dot(normal, half).max(0.0);
        let (n_squares, strength) = if gloss < 0.5 { (4, 0.35) } else { (7, 2.0) };
        for _ in 0..n_squares {
            shine *= shine;
        }
        let shine = shine * gloss * strength * if lambert > 0.0 { 1.0 } else { 0.0 };
        let own = std::array::from_fn(|k| {
            colour[k] * (self.ground[k] + (self.sky[k] - self.ground[k]) * up) + self.rim[k] * rim
        });
        [own, std::array::from_fn(|k| self.key[k] * (colour[k] * lambert + shine))]
    }
}

/// Cosine of the angle beyond 90 degrees at which the key light still has an effect.
const WRAP: f32 = 0.12;

#[inline(always)]
pub fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Unit vector along `a`; a null vector is returned unchanged.
#[inline(always)]
pub fn direction(a: [f32; 3]) -> [f32; 3] {
    let square = dot(a, a);
    if square > 0.0 {
        let by = 1.0 / square.sqrt();
        a.map(|v| v * by)
    } else {
        a
    }
}
